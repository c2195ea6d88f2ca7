"""Scratched glass, traced and on the stage."""
