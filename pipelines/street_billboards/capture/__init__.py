"""From photographs to coloured points, their exposures, and the sky behind them.

``centred_photographs`` for the stage; ``stereo`` (with ``depth_refinement``, ``slanted_windows``,
``weighted_median``) finds depth from cameras beside each other, ``plane_sweep`` (with ``census``,
``semi_global``) from one along the road; ``point_fusion`` keeps what ``multi_view_consistency``
confirms; ``surface_depth`` is the depth of points; ``exposure`` evens out what ``observations``
compare. ``held_out``, ``drive_agreement``, ``drive_depth`` and ``drive_points`` are about whole
drives.
"""
