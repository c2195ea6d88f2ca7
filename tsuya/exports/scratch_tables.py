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

scratch_table   rho(phi_o, phi_i): row o, column i, of M bins outside, then M inside;
                a table for each lean, one below the other; half floats
leans           of each table: a direction's component along the scratch times the refractive index
                where it is: {leans}
coverage        a layer each: the part of a texel that scratches cover, 0 to 1; row 0 is at v = 0
angles          direction of each layer's scratches, radians: {angles}

refractive index {refractive_index}, roughness of the walls {roughness}, side of a tile {tile}
walls keep the lean: {keeps}

What a view in bin o gets from bin i is the part rho w r / pi of radiance over n². w is the
difference of the sines of the bin's ends. r is 1 outside; inside it is n² where walls forget the
lean s, sqrt((n² - s²) / (1 - s²)) where they keep it. There the last table is that of leans from 1
on, which are inside alone: its r is 1.
"""
_PARAMETERS = ("refractive_index", "roughness", "keeps_lean", "tile")


def write_exr(package: Package, target: Path) -> Notes:
    """A folder: `scratch_table.exr`, `coverage.exr`, and what they are as text.

    Raises BadInput.
    """
    arrays = scratch_arrays(package)
    target.mkdir(parents=True)
    table = arrays["table"]
    _write_channels(target / "scratch_table.exr", {"Y": table.reshape(-1, table.shape[2])})
    layers = {f"layer_{n + 1}": layer for n, layer in enumerate(arrays["coverage"])}
    _write_channels(target / "coverage.exr", layers)
    values: dict[str, Any] = {name: package.parameter(name) for name in _PARAMETERS}
    values |= {
        name: ", ".join(f"{value:.6f}" for value in arrays[name]) for name in ("angles", "leans")
    }
    keeps = "yes" if values.pop("keeps_lean") else "no"
    text = _README.format(title=package.meta["title"], keeps=keeps, **values)
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
    """table (S, 2 M, 2 M) float16, leans (S,), angles (L,), coverage (L, R, R) float32 in [0, 1].

    Raises BadInput.
    """
    import numpy as np

    codes = package.textures("coverage")[..., 0]
    return {
        "table": package.array("table"),
        "leans": package.array("leans"),
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
