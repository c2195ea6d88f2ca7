"""The fur that a package holds, to be drawn."""

from __future__ import annotations

from pipelines.photo_fur.packed_fur import PackedFur
from storage.packages import Package


def packaged_fur(package: Package) -> PackedFur:
    """What a `photo_fur` package was made of. Raises BadInput."""
    import numpy as np

    from pipelines.photo_fur.attenuation import Attenuation
    from pipelines.photo_fur.laying import Patches
    from pipelines.photo_fur.shells import ShellMesh, shell_vertices
    from storage.packages.photo_fur import PACKAGE
    from storage.readers.bad_input import BadInput

    if package.meta["schema"] != PACKAGE.number:
        expected = f"{PACKAGE.number}, as this Tsuya makes them: make the package again"
        raise BadInput(package.name, "schema", f"{package.meta['schema']}", expected)
    mesh = package.mesh("mesh")
    assert mesh.normals is not None
    assert mesh.uvs is not None
    layers, thickness = package.parameter("layers"), package.parameter("thickness")
    shells = shell_vertices(mesh.vertices, mesh.normals, thickness, layers)
    has_holes = "opaque" in package.parts
    return PackedFur(
        package.array("photograph").tobytes(),
        package.picture("opaque")[..., 0] >= 128 if has_holes else None,
        Attenuation(package.parameter("brightest"), package.parameter("darkest")),
        ShellMesh(shells, mesh.normals, mesh.triangles, mesh.uvs, thickness),
        package.array("lie"),
        np.array(package.parameter("backwards"), np.float64),
        Patches(
            package.array("patch_vertex").astype(np.int64),
            package.array("patch_place"),
            package.array("patch_direction"),
        ),
        package.parameter("patch_spacing"),
        package.parameter("photograph_width"),
    )
