"""Where scratches lie on a surface."""
