"""A folder that Mitsuba renders: a plug-in, its data, a mesh, `scene.xml`, `render.py`."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from storage.packages import Package

if TYPE_CHECKING:
    from pipelines.drawing.stage import Camera

_HERE = Path(__file__).parent


def write_folder(target: Path, plug_in: str, arrays: Mapping[str, Any], scene: str) -> None:
    """Write all but meshes and pictures; ``arrays`` become `data.npz`."""
    target.mkdir(parents=True, exist_ok=True)
    for name in (f"{plug_in}.py", "render.py"):
        (target / name).write_bytes((_HERE / name).read_bytes())
    with (target / "data.npz").open("wb") as file:
        np.savez_compressed(file, **arrays)
    (target / "scene.xml").write_text(scene, encoding="utf-8")


def sensor_xml(camera: Camera) -> str:
    """The camera, for 320 x 240 pixels and 16 samples a pixel unless `render.py` says otherwise."""
    position, target, up = (_numbers(v) for v in (camera.position, camera.target, camera.up))
    if camera.height is None:
        kind, extent = "perspective", f'<float name="fov" value="{camera.view_angle:g}"/>'
        extent += '\n    <string name="fov_axis" value="y"/>'
        scale = ""
    else:
        kind, extent = "orthographic", ""
        half = camera.height / 2
        scale = f'<scale x="{half * 4 / 3:g}" y="{half:g}"/>'
    return f"""\
  <sensor type="{kind}">
    {extent}
    <transform name="to_world">
      {scale}
      <lookat origin="{position}" target="{target}" up="{up}"/>
    </transform>
    <film type="hdrfilm">
      <integer name="width" value="$width"/>
      <integer name="height" value="$height"/>
      <rfilter type="box"/>
    </film>
    <sampler type="multijitter"><integer name="sample_count" value="$samples"/></sampler>
  </sensor>
"""


SIZES_XML = """\
  <default name="width" value="320"/>
  <default name="height" value="240"/>
  <default name="samples" value="16"/>
"""


def write_ply(
    path: Path,
    vertices: NDArray[np.floating],
    triangles: NDArray[np.integer],
    normals: NDArray[np.floating],
    uvs: NDArray[np.floating] | None = None,
) -> None:
    """A mesh as little-endian PLY with normals and, as Mitsuba reads them, u and v."""
    columns = ["x", "y", "z", "nx", "ny", "nz"]
    values = [vertices, normals]
    if uvs is not None:
        columns += ["u", "v"]
        values.append(uvs)
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(vertices)}"]
    header += [f"property float {name}" for name in columns]
    header += [f"element face {len(triangles)}", "property list uchar int vertex_indices"]
    faces = np.empty(len(triangles), [("count", "u1"), ("corner", "<i4", 3)])
    faces["count"], faces["corner"] = 3, triangles
    with path.open("wb") as file:
        file.write("\n".join([*header, "end_header\n"]).encode())
        file.write(np.concatenate(values, axis=1).astype("<f4").tobytes())
        file.write(faces.tobytes())


def first_view(package: Package) -> tuple[Camera, Mapping[str, Any]]:
    """Camera and state of the package's first view. Raises ValueError where it has none."""
    from pipelines.drawing.stage import Camera

    if not package.meta["views"]:
        raise ValueError(f"{package.name} has no views; expected a package with some.")
    view: Mapping[str, Any] = package.meta["views"][0]
    camera = view["camera"]
    position, target, up = (tuple(camera[name]) for name in ("position", "target", "up"))
    angle, height = float(camera["view_angle"]), camera.get("height")
    return Camera(position, target, up, view_angle=angle, height=height), view["state"]


def _numbers(values: Any) -> str:
    return ", ".join(f"{float(value):.9g}" for value in values)
