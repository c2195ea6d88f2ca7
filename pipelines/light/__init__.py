"""Light: directions above a surface, and what shines from far away.

``directions``: theta and phi, the tables of goniometers, the stereographic plane.
``environment_maps``: equirectangular radiance, its texels and solid angles, turning it;
``built_in_environments``: even light, a sky with a sun, lamps; ``room``: a furnished room by day;
``environment_lookup``: what comes from a direction; ``environment_sampling``: directions drawn by
luminance, and their density.
"""
