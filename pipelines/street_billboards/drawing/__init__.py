"""Streets on the stage."""
