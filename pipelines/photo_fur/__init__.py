"""Fur from one photograph (docs/fur.md).

Sections and equations named in this package are those of the fur paper that the page cites. In the
order of the method:

1. ``photograph``: expose a photograph (``expose``), bring it to size (``fit_size``), read the
   medium from its histogram (``fur_photograph``).
2. ``attenuation``: how light decays from the tips to the skin (``fit_attenuation``), and with that
   the layer of every pixel (``layer_of``, ``make_shell_stack``) and the shader's ``depth_code``.
3. ``shells``: a mesh's vertices offset along its normals, one set a layer (``make_shell_mesh``).
4. ``stage_view``: all shells as one actor for ``drawing.stage`` (``fur_texture``, ``fur_surface``);
   ``frames``: pictures of it from several views (``draw_frames``).
5. ``lie``: how hair lies on a body (``lie_field``); ``photograph_lie``: and in the photograph, of
   which pieces may be taken (``pieces_of``); ``laying``: pieces laid over the body in patches
   (``choose_patches``, ``lay``; ``chart_kernel`` is their compiled part); ``laid_fur``: these on
   the stage (``laid_surface``), ``frames`` draws them (``draw_laid_frames``).
6. ``packed_fur``: what a package holds of all that (``packed_fur``), by ``packed_photograph`` and
   ``lie_codes``; ``live_parts``: the scene that live views show, and their reference pictures.

``pictures`` shows the histogram and the layers; ``figures`` tells whether results are right.
"""
