"""Scratches on glass, from a cross-section to pictures (docs/scratches.md).

Sections and equations named in this package are those of the paper that the page cites. In the
order of the method:

1. ``tables``: a cross-section (``profiles``); walls of glass (``groove_walls``), their table
   exactly where they scatter evenly (``facets``, ``radiosity``, ``glass_radiosity``) or by paths
   (``glass_paths``): ``glass_table``; the paper's model (``scratch_table``, by ``radiosity`` or
   ``monte_carlo``; ``fresnel``; ``paper_table``); either as one table of both sides
   (``bsdf_table``), and the BSDF in space and its sampling (``lobe``, ``sampling``).
2. ``layers``: scratches in a tile that repeats (``settings``, ``scratch_layers``,
   ``features``), how much they cover (``coverage``), the one at a point (``feature_search``).
3. ``scratched_glass``: both together, and a solid with them on it.
4. ``drawing``: the solid by path tracing (``path_tracing``: ``scratch_lookup``, ``smooth_glass``,
   ``scratch_scattering``), by a shader on the stage (``stage_view``), and in the system's views
   (``frames``).

``figures`` tells whether results are right.
"""
