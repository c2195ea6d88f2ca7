"""Directions, and maps of light around a scene."""
