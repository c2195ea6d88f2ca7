"""A neural BTF for Mitsuba 3: the plug-in `tsuya_btf` and the package's cloth."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from storage.packages import Mesh, Package
from tsuya.exports.format import Notes
from tsuya.exports.mitsuba.folder import (
    SIZES_XML,
    first_view,
    sensor_xml,
    write_folder,
    write_ply,
)

if TYPE_CHECKING:
    from pipelines.drawing.stage import Camera
    from pipelines.neural_btf.compressed import CompressedBtf

_SCENE = """\
<scene version="3.0.0">
{sizes}  <integrator type="direct">
    <integer name="bsdf_samples" value="0"/>
  </integrator>
{sensor}\
  <!-- An irradiance of pi: white Lambertian cloth would have the cosine of the light's angle. -->
  <emitter type="directional">
    <vector name="direction" value="{direction}"/>
    <rgb name="irradiance" value="{irradiance:.9g}"/>
  </emitter>
  <shape type="ply">
    <string name="filename" value="cloth.ply"/>
    <bsdf type="twosided">
      <bsdf type="tsuya_btf">
        <string name="filename" value="data.npz"/>
        <float name="tiles" value="{tiles:.9g}"/>
      </bsdf>
    </bsdf>
  </shape>
</scene>
"""


def write_btf(package: Package, target: Path) -> Notes:
    """The plug-in's folder of a `neural_btf` package. Raises BadInput, ValueError."""
    from tsuya.exports.packaged_btf import packaged_btf

    camera, state = first_view(package)
    write_btf_folder(
        packaged_btf(package),
        package.mesh("cloth"),
        target,
        camera=camera,
        light=state["light"],
        tiles=float(state["tiles"]),
        exposure=float(package.parameter("exposure")) * 2.0 ** float(state["exposure"]),
    )
    return (
        "Scalar variants of Mitsuba alone: the decoder goes through Python, some 0.1 ms a ray.",
        "Mitsuba casts the cloth's shadows on itself, which the stage does not.",
        "Latents are looked up at the finest level, whatever a pixel sees: take samples.",
        "Below 75 degrees, where nothing was measured, the value there is taken, dimmed with the "
        "light's cosine.",
    )


def write_btf_folder(
    btf: CompressedBtf,
    cloth: Mesh,
    target: Path,
    *,
    camera: Camera,
    light: Sequence[float],
    tiles: float,
    exposure: float,
) -> None:
    """The same of a BTF on a cloth with texture coordinates, under a light in a direction (3,)."""
    scene = _SCENE.format(
        sizes=SIZES_XML,
        sensor=sensor_xml(camera),
        direction=", ".join(f"{-float(value):.9g}" for value in light),
        irradiance=math.pi * exposure,
        tiles=tiles,
    )
    write_folder(target, "tsuya_btf", plug_in_arrays(btf), scene)
    assert cloth.normals is not None
    write_ply(target / "cloth.ply", cloth.vertices, cloth.triangles, cloth.normals, cloth.uvs)


def plug_in_arrays(btf: CompressedBtf) -> dict[str, Any]:
    """What `tsuya_btf.py` reads."""
    from pipelines.neural_btf.importance import importance_table
    from pipelines.neural_btf.latent_texture import MONOMIALS

    latents = btf.latents_of(slice(None))
    return {
        **{name: values.astype(np.float32) for name, values in btf.decoder.items()},
        "latents": latents.reshape(btf.height, btf.width, latents.shape[1]),
        "parallax": np.zeros((MONOMIALS, 2), np.float32) if btf.parallax is None else btf.parallax,
        "alpha": np.float32(btf.alpha),
        "bounds": np.array([btf.least, btf.largest], np.float32),
        "shares": importance_table(btf).shares,
    }
