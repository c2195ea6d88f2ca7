"""Scratches that a photograph of scratched glass shows, and layers like them."""
