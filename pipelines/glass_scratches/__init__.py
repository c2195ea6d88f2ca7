"""Scratches on glass (docs/scratches.md): arrays in, arrays out."""
