"""Environments as spherical Gaussians, and what surfaces make of them."""
