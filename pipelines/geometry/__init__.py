"""Geometry: triangle meshes and solids, rays, cameras.

``shapes``: a square, a sphere, the Utah teapot (``teapot_patches``), as ``meshes`` with normals and
texture coordinates (``grid_charts`` of built-in shapes, ``texture_coordinates`` of any mesh).
``repair``: meshes from files merged, cleaned and oriented, by their ``mesh_edges``;
``mended_meshes``: with texture coordinates, too. ``solids``: closed meshes of glass, small holes
under ``lids``; ``solid_shapes``: a plate and a teapot with walls. ``rays``: first hits, visibility
and what is seen from outside, by Embree. ``cameras``: pinholes, projection there and back.
"""
