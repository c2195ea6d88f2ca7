"""What draws: whether OpenGL works without a screen, and how large its textures may be."""

from __future__ import annotations

import functools
import os
import sys
from typing import Any, cast


class NoGraphicsError(RuntimeError):
    """There is no OpenGL driver to draw with."""


@functools.cache
def require_graphics() -> None:
    """Make sure that VTK can draw without a screen. Raises NoGraphicsError."""
    if not sys.platform.startswith("linux"):
        return
    os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
    from vtkmodules.vtkCommonCore import vtkLogger, vtkObject
    from vtkmodules.vtkRenderingOpenGL2 import vtkEGLRenderWindow

    warnings, verbosity = vtkObject.GetGlobalWarningDisplay(), vtkLogger.GetCurrentVerbosityCutoff()
    vtkObject.SetGlobalWarningDisplay(0)
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)
    try:
        window = vtkEGLRenderWindow()
        window.SetOffScreenRendering(True)
        window.Initialize()
        works = window.SupportsOpenGL()
        window.Finalize()
    finally:
        vtkObject.SetGlobalWarningDisplay(warnings)
        vtkLogger.SetStderrVerbosity(verbosity)
    if not works:
        raise NoGraphicsError(
            "OpenGL cannot be started: EGL found no driver; expected a graphics card's driver or "
            "Mesa (Debian, Ubuntu: sudo apt-get install libegl1 libgl1-mesa-dri)."
        )


@functools.cache
def largest_texture() -> int:
    """Texels of the side of the driver's largest texture. Raises NoGraphicsError."""
    require_graphics()
    from vtkmodules.vtkRenderingCore import vtkRenderWindow
    from vtkmodules.vtkRenderingOpenGL2 import vtkTextureObject

    window = vtkRenderWindow()
    window.SetOffScreenRendering(True)
    window.Initialize()
    most = int(vtkTextureObject.GetMaximumTextureSize(cast(Any, window)))
    window.Finalize()
    return most
