"""A draped cloth of the material, and its pictures by Monte Carlo under light from all around.

``table`` is what the cloth lies on, ``simulation`` lets it fall there, ``draped_cloth`` makes the
smooth mesh. ``sights`` are what a camera's rays meet, ``gathering`` draws directions of light for
them, ``rendering`` puts a picture together. ``materials`` are what a picture can show beside a
compressed BTF: what was measured, and one colour. ``frames`` are the pictures that are shown.

World: z up, the floor at 0; a unit is a metre.
"""
