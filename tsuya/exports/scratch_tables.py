"""Scratch tables and where scratches lie, for other renderers: OpenEXR, NumPy."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from storage.packages import Package
from tsuya.exports.format import Format, Notes

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

_SYSTEM = ("glass_scratches",)
_README = """\
{title}

Arrays are as docs/packages.md has them; phi is the angle across a scratch, from -90 to 90 degrees.

scratch_table   rho_m(phi_o, phi_i): row o, column i; half floats
leaning         over phi_o: Fresnel's factor at theta = 0; the exponent gamma (Eq. 2 and 4)
coverage        a layer each: the part of a texel that scratches cover, 0 to 1; row 0 is at v = 0
angles          direction of each layer's scratches, radians: {angles}

refractive index {refractive_index}, roughness of the walls {roughness}, side of a tile {tile}

A scratch reflects 2 F / pi^2 * rho_m, F = R + (1 - R) F0, R = (2 theta / pi)^gamma; theta is the
angle between the view and the plane across the scratch.
"""
_PARAMETERS = ("refractive_index", "roughness", "tile")


def write_exr(package: Package, target: Path) -> Notes:
    """A folder: `scratch_table.exr`, `leaning.exr`, `coverage.exr`, and what they are as text.

    Raises BadInput.
    """
    arrays = scratch_arrays(package)
    target.mkdir(parents=True)
    _write_channels(target / "scratch_table.exr", {"Y": arrays["table"]})
    factor, gamma = arrays["leaning"]
    _write_channels(target / "leaning.exr", {"F0": factor[None], "gamma": gamma[None]})
    layers = {f"layer_{n + 1}": layer for n, layer in enumerate(arrays["coverage"])}
    _write_channels(target / "coverage.exr", layers)
    angles = ", ".join(f"{angle:.6f}" for angle in arrays["angles"])
    values = {name: package.parameter(name) for name in _PARAMETERS}
    text = _README.format(title=package.meta["title"], angles=angles, **values)
    (target / "readme.txt").write_text(text, "utf-8")
    return ("Coverage has 8 bits, as in the package: up to 0.002 off what the graph made.",)


def write_npz(package: Package, target: Path) -> Notes:
    """One file of all arrays and numbers, by the names of the package. Raises BadInput."""
    import numpy as np

    numbers = {name: np.float64(package.parameter(name)) for name in _PARAMETERS}
    with target.open("wb") as file:
        np.savez_compressed(file, **scratch_arrays(package), **numbers)  # type: ignore[arg-type]
    return ("Coverage has 8 bits, as in the package: up to 0.002 off what the graph made.",)


def scratch_arrays(package: Package) -> dict[str, NDArray[np.floating[Any]]]:
    """table (M, M) float16, leaning (2, M), angles (L,), coverage (L, R, R) float32 in [0, 1].

    Raises BadInput.
    """
    import numpy as np

    codes = package.textures("coverage")[..., 0]
    return {
        "table": package.array("table"),
        "leaning": package.array("leaning"),
        "angles": package.array("angles"),
        "coverage": codes.astype(np.float32) / np.float32(255.0),
    }


def _write_channels(path: Path, channels: dict[str, NDArray[np.floating[Any]]]) -> None:
    import numpy as np
    import OpenEXR

    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    whole = {name: np.ascontiguousarray(values) for name, values in channels.items()}
    with OpenEXR.File(header, whole) as file:
        file.write(str(path))


FORMATS = (
    Format("exr", _SYSTEM, "", "scratch table and coverage of the layers, OpenEXR", write_exr),
    Format("npz", _SYSTEM, ".npz", "scratch table, layers' coverage and numbers, NumPy", write_npz),
)
