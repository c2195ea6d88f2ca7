"""Scratched glass for Mitsuba 3: the plug-in `tsuya_scratches`, the object, light around it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from storage.packages import Package
from tsuya.exports.format import Notes
from tsuya.exports.mitsuba.folder import (
    SIZES_XML,
    first_view,
    sensor_xml,
    write_folder,
    write_ply,
)

SCENE = """\
<scene version="3.0.0">
{sizes}  <integrator type="path">
    <integer name="max_depth" value="16"/>
    <integer name="rr_depth" value="8"/>
  </integrator>
{sensor}\
  <!-- Mitsuba's maps have y up; ours z. -->
  <emitter type="envmap">
    <string name="filename" value="environment.exr"/>
    <float name="scale" value="{scale:.9g}"/>
    <transform name="to_world"><matrix value="0 0 1 0  1 0 0 0  0 1 0 0  0 0 0 1"/></transform>
  </emitter>
  <shape type="ply">
    <string name="filename" value="object.ply"/>
    <bsdf type="tsuya_scratches"><string name="filename" value="data.npz"/></bsdf>
  </shape>
</scene>
"""


def write_scratches(package: Package, target: Path) -> Notes:
    """The plug-in's folder of a `glass_scratches` package. Raises BadInput."""
    arrays = {name: package.array(name) for name in ("table", "leans", "angles")}
    arrays["coverage"] = package.textures("coverage")[..., 0]
    arrays |= {
        name: np.array(package.parameter(parameter), np.float64)
        for name, parameter in (
            ("index", "refractive_index"), ("keeps", "keeps_lean"), ("tile", "tile"),
        )
    }  # fmt: skip
    bits = package.picture(f"environment_{package.parameter('environment')}")
    scene = SCENE.format(
        sizes=SIZES_XML,
        sensor=sensor_xml(first_view(package)[0]),
        scale=float(package.parameter("exposure")),
    )
    write_folder(target, "tsuya_scratches", arrays, scene)
    write_environment(target / "environment.exr", bits.view(np.float16).astype(np.float32))
    glass = package.mesh("object")
    assert glass.normals is not None
    write_ply(target / "object.ply", glass.vertices, glass.triangles, glass.normals)
    return (
        "Scalar variants of Mitsuba alone: a path goes through Python, some 0.1 ms an event.",
        "Close up, scratches are as sharp as the coverage's map, not as the features themselves.",
        "How light varies across a scratch is left out: its mean is taken.",
        "Small lamps behind rough walls are found by chance: some 500 samples a pixel.",
    )


def write_environment(path: Path, radiance: NDArray[np.float32]) -> None:
    """An equirectangular map (H, W, 3), row 0 at the zenith, as Mitsuba wants it.

    Mitsuba's first and last rows lie at the poles, ours half a row from there: of 2 H + 1 rows
    each second one is ours.
    """
    from tsuya.picture_files import write_picture

    rows = np.empty((2 * len(radiance) + 1, *radiance.shape[1:]), np.float32)
    rows[1::2] = radiance
    rows[2:-1:2] = (radiance[1:] + radiance[:-1]) / 2
    rows[0], rows[-1] = radiance[0].mean(axis=0), radiance[-1].mean(axis=0)
    write_picture(rows, path.with_suffix(""), "exr")
