"""Lit scenes, traced and on the stage."""
