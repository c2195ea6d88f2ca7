"""From photographs to coloured points."""
