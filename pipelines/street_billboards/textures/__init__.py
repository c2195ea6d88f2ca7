"""What billboards look like from each side, made small.

``view_directions``: from where. ``photographs`` says which photographs are asked,
``texel_sampling`` what they show, ``view_textures`` makes views of it. ``eigen_textures``
compresses them (with ``rank_allocation``, ``eigen_kernels``, ``low_rank_fit``,
``plane_resolution``; ``paper_form``: as in the paper) and ``masks`` says where they are opaque.
``decoding`` undoes it, ``atlases`` packs it. ``texture_tables``, ``coded_arrays``: what is kept.
"""
