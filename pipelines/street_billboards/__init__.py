"""Streets from eigen-textured billboards (docs/street.md).

Sections and equations named in this package are those of the paper that the page cites. In the
order of the method:

0. ``poses``: where the photographs were taken, and in which world (``worlds``).
1. ``capture``: a drive's photographs become depths (``stereo`` of cameras in a row, ``plane_sweep``
   along the road of one), what neighbouring frames confirm becomes points
   (``multi_view_consistency``, ``point_fusion``), these tell exposures (``observations``,
   ``exposure``); ``sky`` is behind. ``drive_depth``, ``drive_points``: whole drives, frames loaded
   as they come.
2. ``octree`` splits space into voxels, ``billboards`` lays a rectangle through the points of each
   (4.1: ``octree_leaves``, ``fit_billboards``); ``road_tiles`` puts them in the road's order.
3. ``textures``: photographs sampled from each direction (4.2.1: ``view_textures``), made small
   (4.2, Eq. 1: ``eigen_textures.compress_views``), packed for the graphics card (4.3:
   ``atlases.pack_pages``); ``decoding`` gives them back on the processor.
4. ``drawing``: the street on the stage (``shader_street``, ``street_stage``); ``frames``: all
   pictures of a drive.

``poses`` comes before them where a drive has none: found in a film, or adjusted (``found_poses``,
``adjusted_poses``).

``whole_street`` does steps 1 to 3 on photographs in memory by one call; ``figures`` tells whether
results are right.
"""
