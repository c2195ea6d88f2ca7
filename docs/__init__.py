"""Pages that a user reads, and the one that is made from the schemas."""
