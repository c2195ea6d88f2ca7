"""An offscreen stage to draw on: cameras, lights, environment, textures, GLSL, frames.

Everything is in linear light: textures are decoded when they are sampled, the framebuffer holds
float radiance, and only ``Stage.frame`` encodes it as 8-bit sRGB. Pictures are the same, bit for
bit, each time they are drawn on one machine.

VTK draws through EGL, with a graphics card or with Mesa's software renderer; there is no
multisampling (five times the time in software): ``supersampling`` averages radiance instead.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import TracebackType
from typing import Any, Literal, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pipelines.drawing.colour import to_8bit
from pipelines.drawing.glsl import Shader, surface_shader
from pipelines.drawing.graphics_driver import require_graphics

Vector = tuple[float, float, float]
Wrap = Literal["repeat", "mirrored", "clamp"]

_VTK_FLOAT = 10
_WRAP_CODE = {"clamp": 0, "repeat": 1, "mirrored": 2}


# ---- cameras and lights ----------------------------------------------------------------------


@dataclass(frozen=True)
class Camera:
    """Where the picture is taken from; lengths in scene units, angles in degrees."""

    position: Vector
    target: Vector
    up: Vector = (0.0, 0.0, 1.0)
    view_angle: float = 30.0
    """Vertical field of view of a perspective camera."""
    height: float | None = None
    """Height of the picture in scene units; given, the camera is orthographic."""


@dataclass(frozen=True)
class Light:
    """A directional light of the given radiance colour."""

    towards: Vector | None = None
    """Direction from the scene to the light; None: along the view."""
    colour: Vector = (1.0, 1.0, 1.0)


def orbit(
    target: Vector,
    distance: float,
    azimuth: float,
    elevation: float,
    *,
    view_angle: float = 30.0,
    height: float | None = None,
) -> Camera:
    """A camera on a sphere about the target, z up.

    Azimuth 0 lies on +x and turns towards +y; elevation 90 looks straight down with +y upwards in
    the picture. Angles in degrees.

    >>> camera = orbit((0.0, 0.0, 1.0), 4.0, azimuth=-90.0, elevation=0.0)
    >>> [round(value, 9) for value in camera.position], camera.up
    ([0.0, -4.0, 1.0], (0.0, 0.0, 1.0))
    """
    around, above = math.radians(azimuth), math.radians(elevation)
    outward = np.array(
        [math.cos(above) * math.cos(around), math.cos(above) * math.sin(around), math.sin(above)]
    )
    x, y, z = np.asarray(target) + distance * outward
    overhead = abs(elevation) > 89.9
    return Camera(
        position=(float(x), float(y), float(z)),
        target=target,
        up=(0.0, 1.0, 0.0) if overhead else (0.0, 0.0, 1.0),
        view_angle=view_angle,
        height=height,
    )


def fitting_distance(
    points: NDArray[np.floating],
    target: Vector,
    azimuth: float,
    elevation: float,
    *,
    view_angle: float,
    aspect: float,
) -> float:
    """Distance from which an orbiting camera has all points (n, 3) just inside its picture.

    ``aspect`` is width / height; angles in degrees as in ``orbit``.

    >>> import numpy as np
    >>> square = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], float)
    >>> round(fitting_distance(square, (0, 0, 0), 0.0, 90.0, view_angle=90.0, aspect=1.0), 6)
    1.0
    """
    camera = orbit((0.0, 0.0, 0.0), 1.0, azimuth, elevation)
    back = np.array(camera.position)
    right = np.cross(camera.up, back)
    right /= np.linalg.norm(right)
    up = np.cross(back, right)
    offsets = np.asarray(points, dtype=np.float64) - np.asarray(target)
    slope = math.tan(math.radians(view_angle / 2))
    needed = offsets @ back + np.maximum(
        np.abs(offsets @ up) / slope, np.abs(offsets @ right) / (slope * aspect)
    )
    return float(needed.max())


# ---- textures and surfaces -------------------------------------------------------------------


def texture(
    image: NDArray[Any],
    *,
    wrap: Wrap = "clamp",
    interpolate: bool = True,
    mipmap: bool = False,
    anisotropic: bool = True,
    srgb: bool = False,
) -> Any:
    """An array (height, width, channels) as a VTK texture; row 0 is the top of the picture.

    One channel is grey, two are red and green. uint8 stays 8 bit a channel; ``srgb`` says that its
    colours are sRGB codes, decoded when they are sampled (alpha is not). float32 stays float32.
    Mipmaps are anisotropic as drivers see fit: each has another picture.
    """
    from vtkmodules.util.numpy_support import numpy_to_vtk
    from vtkmodules.vtkCommonDataModel import vtkImageData
    from vtkmodules.vtkRenderingOpenGL2 import vtkOpenGLTexture

    known = image.dtype in (np.uint8, np.float32) and image.ndim == 3 and 1 <= image.shape[2] <= 4
    if not known:
        raise ValueError(
            f"texture is {image.dtype} {image.shape}; expected uint8 or float32 (y, x, channel) "
            "with 1 to 4 channels."
        )
    # VTK would draw one or two channels through a colour map, in 8 bit.
    if image.shape[2] == 1:
        image = image.repeat(3, axis=2)
    elif image.shape[2] == 2:
        image = np.pad(image, ((0, 0), (0, 0), (0, 1)))
    height, width, channels = image.shape
    flipped = np.ascontiguousarray(image[::-1]).reshape(-1, channels)
    data = vtkImageData()
    data.SetDimensions(width, height, 1)
    data.GetPointData().SetScalars(numpy_to_vtk(flipped, deep=True))
    made = vtkOpenGLTexture()
    made.SetInputData(data)
    made.SetColorModeToDirectScalars()
    made.SetInterpolate(interpolate)
    made.SetMipmap(mipmap)
    if not anisotropic:
        made.SetMaximumAnisotropicFiltering(1.0)
    made.SetWrap(_WRAP_CODE[wrap])
    made.SetUseSRGBColorSpace(srgb)
    return made


PAINTED = surface_shader("painted_vertex.glsl", "painted_fragment.glsl")
"""Shows the attribute ``shown`` (V, 3), linear colours, of a surface that is not lit."""


def surface(
    vertices: ArrayLike,
    triangles: ArrayLike,
    *,
    normals: ArrayLike | None = None,
    attributes: Mapping[str, ArrayLike] | None = None,
    textures: Mapping[str, Any] | None = None,
    shader: Shader | None = None,
    colour: Vector = (1.0, 1.0, 1.0),
    lit: bool = True,
) -> Any:
    """A triangle mesh as a VTK actor in one draw call.

    vertices (V, 3), triangles (F, 3), normals (V, 3). ``attributes`` are float arrays (V,) or
    (V, k), k <= 4: the vertex shader has them under their names. ``textures`` become samplers
    under theirs. ``lit`` surfaces are Lambertian with the linear ``colour`` as albedo.
    """
    import pyvista as pv
    from vtkmodules.vtkCommonDataModel import vtkDataObject
    from vtkmodules.vtkRenderingCore import vtkActor
    from vtkmodules.vtkRenderingOpenGL2 import vtkOpenGLPolyDataMapper

    corners = np.asarray(triangles)
    points: Any = np.asarray(vertices, dtype=np.float32)
    mesh = pv.PolyData.from_regular_faces(points, corners)
    if normals is not None:
        mesh.point_data.active_normals = np.asarray(normals, dtype=np.float32)
    mapper = vtkOpenGLPolyDataMapper()
    mapper.SetInputDataObject(mesh)
    mapper.ScalarVisibilityOff()
    mapper.SetVBOShiftScaleMethod(0)
    for name, values in (attributes or {}).items():
        mesh.point_data[name] = np.asarray(values, dtype=np.float32)
        mapper.MapDataArrayToVertexAttribute(name, name, vtkDataObject.FIELD_ASSOCIATION_POINTS, -1)
    actor = vtkActor()
    actor.SetMapper(mapper)
    looks = actor.GetProperty()
    looks.SetColor(*colour)
    looks.SetAmbient(0.0)
    looks.SetDiffuse(1.0)
    looks.SetSpecular(0.0)
    looks.SetLighting(lit)
    looks.SetInterpolationToPhong()
    for name, image in (textures or {}).items():
        looks.SetTexture(name, image)
    if shader is not None:
        replacements = actor.GetShaderProperty()
        for tag, code in shader.vertex.items():
            replacements.AddVertexShaderReplacement(f"//VTK::{tag}", True, code, False)
        for tag, code in shader.fragment.items():
            replacements.AddFragmentShaderReplacement(f"//VTK::{tag}", True, code, False)
    return actor


# ---- the stage -------------------------------------------------------------------------------


class Stage:
    """An offscreen picture of width x height pixels; use it as a context manager.

    ``background`` is a linear colour, or an environment: linear radiance (height, width, 3) in
    equirectangular layout, z up, as seen from inside (not mirrored): azimuth 0 is in the middle,
    azimuth 90 a quarter of the width from the left edge. Raises NoGraphicsError.
    """

    def __init__(
        self,
        width: int,
        height: int,
        *,
        background: Vector | NDArray[np.float32] = (0.0, 0.0, 0.0),
        supersampling: int = 1,
    ) -> None:
        require_graphics()
        import pyvista as pv

        self.width, self.height, self.supersampling = width, height, supersampling
        size = (width * supersampling, height * supersampling)
        self._plotter = pv.Plotter(off_screen=True, window_size=list(size), lighting="none")
        window: Any = self._plotter.render_window
        self._window = window
        window.SetMultiSamples(0)
        self._renderer = self._plotter.renderer
        window.Render()
        for buffer in (window.GetRenderFramebuffer(), window.GetDisplayFramebuffer()):
            buffer.PopulateFramebuffer(*size, True, 1, _VTK_FLOAT, True, 32, 0, False)
        self._has_sky = isinstance(background, np.ndarray)
        if isinstance(background, np.ndarray):
            self._renderer.AddActor(_sky(background))
            # VTK's sky has y up, whatever its floor plane says.
            self._renderer.SetEnvironmentUp(0.0, 0.0, 1.0)
            self._renderer.SetEnvironmentRight(1.0, 0.0, 0.0)
        else:
            self._renderer.SetBackground(*background)
        self._renderer.SetBackgroundAlpha(0.0)
        self.light()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._plotter.close()

    def add(self, *actors: Any) -> None:
        """Put actors on the stage; an actor and its textures are on one stage at a time."""
        for actor in actors:
            self._renderer.AddActor(actor)

    def remove(self, *actors: Any) -> None:
        """Take actors off the stage."""
        for actor in actors:
            self._renderer.RemoveActor(actor)

    def light(self, *lights: Light) -> None:
        """Light the stage by these lights and no others; at first there are none."""
        from vtkmodules.vtkRenderingCore import vtkLight

        self._renderer.RemoveAllLights()
        # With no light at all VTK does not shade: lit surfaces would show their albedo.
        for light in lights or (Light(colour=(0.0, 0.0, 0.0)),):
            made = vtkLight()
            made.SetColor(*light.colour)
            made.PositionalOff()
            if light.towards is None:
                made.SetLightTypeToHeadlight()
            else:
                made.SetLightTypeToSceneLight()
                made.SetFocalPoint(0.0, 0.0, 0.0)
                made.SetPosition(*light.towards)
            self._renderer.AddLight(made)

    def look(self, camera: Camera) -> None:
        """Take the next frames from this camera."""
        view = self._renderer.GetActiveCamera()
        view.SetPosition(*camera.position)
        view.SetFocalPoint(*camera.target)
        view.SetViewUp(*camera.up)
        view.SetParallelProjection(camera.height is not None)
        if camera.height is not None:
            view.SetParallelScale(camera.height / 2)
        view.SetViewAngle(camera.view_angle)

    def draw(self) -> None:
        """Draw and wait until it is done, without reading the picture back."""
        self._renderer.ResetCameraClippingRange()
        self._window.Render()
        self._window.WaitForCompletion()

    def radiance(self) -> NDArray[np.float32]:
        """Draw; linear radiance and coverage by surfaces, (height, width, 4), row 0 at the top."""
        from vtkmodules.util.numpy_support import vtk_to_numpy
        from vtkmodules.vtkCommonCore import vtkFloatArray

        self.draw()
        columns, rows = self.width * self.supersampling, self.height * self.supersampling
        pixels = vtkFloatArray()
        self._window.GetRGBAPixelData(0, 0, columns - 1, rows - 1, 0, pixels, 0)
        picture = vtk_to_numpy(pixels).reshape(rows, columns, 4)[::-1]
        if self._has_sky:  # which is drawn as opaque as a surface, but at infinity
            depths = vtkFloatArray()
            self._window.GetZbufferData(0, 0, columns - 1, rows - 1, depths)
            picture[..., 3] = vtk_to_numpy(depths).reshape(rows, columns)[::-1] < 1.0
        n = self.supersampling
        return picture.reshape(self.height, n, self.width, n, 4).mean(axis=(1, 3))

    def frame(self) -> NDArray[np.uint8]:
        """Draw; the picture as 8-bit sRGB, (height, width, 3), row 0 at the top."""
        return to_8bit(self.radiance()[..., :3])

    def depth(self) -> NDArray[np.float32]:
        """Distances along the optical axis of what was drawn last, (height, width), scene units.

        Row 0 is at the top; inf where there is no surface. With supersampling nothing is averaged:
        a pixel has the distance of its sample nearest to its middle (with an even number, where
        four are equally near, of the one to the lower right). Read from the z-buffer: errors are
        some 1e-7 of distance^2 / the nearest surface's distance.
        """
        from vtkmodules.util.numpy_support import vtk_to_numpy
        from vtkmodules.vtkCommonCore import vtkFloatArray

        columns, rows = self.width * self.supersampling, self.height * self.supersampling
        depths = vtkFloatArray()
        self._window.GetZbufferData(0, 0, columns - 1, rows - 1, depths)
        middle = self.supersampling // 2
        every = vtk_to_numpy(depths).reshape(rows, columns)[::-1]
        part = every[middle :: self.supersampling, middle :: self.supersampling].astype(np.float64)
        camera = self._renderer.GetActiveCamera()
        near, far = camera.GetClippingRange()
        if camera.GetParallelProjection():
            distance = near + part * (far - near)
        else:
            distance = near * far / (far - part * (far - near))
        return np.where(part < 1.0, distance, np.inf).astype(np.float32)

    @property
    def renderer_name(self) -> str:
        """What draws: the OpenGL renderer's own name."""
        capabilities = self._window.ReportCapabilities()
        for line in capabilities.splitlines():
            if line.startswith("OpenGL renderer string:"):
                return str(line.partition(":")[2].strip())
        return "unknown"


def _sky(environment: NDArray[np.float32]) -> Any:
    from vtkmodules.vtkRenderingOpenGL2 import vtkOpenGLSkybox

    sky = vtkOpenGLSkybox()
    # Repeated, the zenith would take half of its light from the nadir.
    sky.SetTexture(texture(np.ascontiguousarray(environment, dtype=np.float32), wrap="clamp"))
    sky.SetProjectionToSphere()
    sky.GammaCorrectOff()
    return sky
