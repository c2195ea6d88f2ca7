"""Image-based lighting by spherical signed distance functions (SSDFs; docs/ssdf.md).

Sections and equations named in this package are those of the paper that the page cites. In the
order of the method:

1. ``scene``: what is lit, repaired and of a size of its own (``built_in_scene``, ``make_scene``).
2. ``distances``: which directions of the octahedral map (``octahedral``) a vertex sees the sky in
   (``visibility``), and how far each is from the edge of the sky (``visible_edge``,
   ``thin_parts``, ``signed_distance``, ``refined``: ``scene_distances``); ``edge_share`` is for
   shaders.
3. ``compression``: a basis of the scene (``shared_basis``), clusters (``triangle_clusters``), few
   bits in them (``compact``, ``compact_file``, ``compact_memory``) or the paper's vectors
   (``clustered_pca``); ``resident`` is what stays while drawing, ``decoder`` gives distances back.
4. ``light``: an environment as spherical Gaussians (``environment_fit``), and what the matt and the
   glossy part of a surface make of them (``cosine_lobes``, ``gloss_lobes``, ``shading``).
5. ``drawing``: the scene under turning light on the stage, and traced (``frames``).

``figures`` and ``thin_figures`` tell whether results are right.
"""
