"""Drawing: what several systems' pictures are made with.

``stage``: scenes drawn offscreen by PyVista; its shaders are the files under ``shaders``, put
together by ``glsl``; ``graphics_driver``: whether anything can draw here. ``colour``: linear light,
sRGB, luminance, exposure; ``picture_metrics``: PSNR, SSIM, FLIP. ``plots``: Matplotlib's figures as
pictures; ``contact_sheet``: several pictures on one.
"""
