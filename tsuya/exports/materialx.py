"""MaterialX: a BTF by its maps, scratched glass as far as `standard_surface` carries it."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING
from xml.sax.saxutils import quoteattr

from storage.packages import Package
from tsuya.exports.format import Format, Notes

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

_DOCUMENT = """\
<?xml version="1.0"?>
<materialx version="1.39" colorspace="lin_rec709">
  <!-- {title} -->
{nodes}
  <standard_surface name="surface" type="surfaceshader">
{inputs}
  </standard_surface>
  <surfacematerial name="material" type="material">
    <input name="surfaceshader" type="surfaceshader" nodename="surface" />
  </surfacematerial>
</materialx>
"""


def write_cloth(package: Package, target: Path) -> Notes:
    """`material.mtlx` of a `neural_btf` package, its maps and errors, in a folder.

    Raises BadInput.
    """
    from tsuya.exports.svbrdf import svbrdf_maps, write_pictures

    maps = svbrdf_maps(package)
    write_pictures(maps, target)
    nodes = [
        _picture("base_colour", "color3", "base_colour.png", "srgb_texture"),
        _picture("surface_codes", "color3", "surface.png"),
        _picture("normal_codes", "vector3", "normal.png"),
        *(
            f'  <extract name="{name}" type="float">\n'
            '    <input name="in" type="color3" nodename="surface_codes" />\n'
            f'    <input name="index" type="integer" value="{index}" />\n  </extract>'
            for name, index in (("roughness", 1), ("metallic", 2))
        ),
        '  <normalmap name="bent" type="vector3">\n'
        '    <input name="in" type="vector3" nodename="normal_codes" />\n  </normalmap>',
    ]
    inputs = [
        ("base", "float", 'value="1"'),
        ("base_color", "color3", 'nodename="base_colour"'),
        ("metalness", "float", 'nodename="metallic"'),
        ("specular_roughness", "float", 'nodename="roughness"'),
        ("specular_IOR", "float", 'value="1.5"'),
        ("normal", "vector3", 'nodename="bent"'),
    ]
    _write(target, package, nodes, inputs)
    return maps.sentences


def write_glass(package: Package, target: Path) -> Notes:
    """`material.mtlx` of a `glass_scratches` package and its coverage, in a folder.

    Raises BadInput.
    """
    import imagecodecs
    import numpy as np

    layers = package.textures("coverage")[..., 0] / 255
    covered = 1 - np.prod(1 - layers, axis=0)
    target.mkdir(parents=True, exist_ok=True)
    # Row 0 of the package lies at v = 0, that of a picture at the top.
    codes = np.rint(covered[::-1] * 255).astype(np.uint8)
    (target / "coverage.png").write_bytes(bytes(imagecodecs.png_encode(codes)))
    table, index = package.array("table"), float(package.parameter("refractive_index"))
    roughness = scratch_roughness(table[0].astype(np.float64), index)
    nodes = [
        _picture("coverage", "float", "coverage.png"),
        '  <multiply name="roughness" type="float">\n'
        '    <input name="in1" type="float" nodename="coverage" />\n'
        f'    <input name="in2" type="float" value="{roughness:.9g}" />\n  </multiply>',
    ]
    inputs = [
        ("base", "float", 'value="0"'),
        ("specular_IOR", "float", f'value="{index:.9g}"'),
        ("specular_roughness", "float", 'nodename="roughness"'),
        ("transmission", "float", 'value="1"'),
    ]
    _write(target, package, nodes, inputs)
    return (
        "Scratches are glass that is rough where they lie: the scratch's table, its "
        "lobes and the directions of layers are not in it; `--to mitsuba` has them.",
        "coverage.png is a tile for texture coordinates 0 to 1; objects of the package have none.",
    )


def scratch_roughness(rho: NDArray[np.float64], index: float) -> float:
    """`specular_roughness` of ground glass that spreads light as a scratch does, of its table
    (2 M, 2 M) of lean 0.

    A wall of slope m bends light that falls straight on the glass to the sine m (1 - 1 / n), for
    small m. So the spread of what the table lets through is a variance of slopes, which for
    scratches in all directions is alpha² of a microfacet surface; alpha is the roughness' square.
    At most 1.

    >>> import numpy as np
    >>> scratch_roughness(np.ones((32, 32)), 1.5)  # walls that scatter evenly
    1.0
    """
    import numpy as np

    bins = len(rho) // 2
    edges = np.sin(np.linspace(-np.pi / 2, np.pi / 2, bins + 1))
    # Seen straight on: from between the two bins in the middle.
    let_through = rho[bins // 2 - 1 : bins // 2 + 1, bins:].mean(axis=0) * np.diff(edges)
    sine2 = (edges[1:] ** 2 + edges[1:] * edges[:-1] + edges[:-1] ** 2) / 3
    spread = float(let_through @ sine2 / max(let_through.sum(), 1e-30))
    alpha = float(np.sqrt(spread)) / (1.0 - 1.0 / index)
    return min(1.0, float(np.sqrt(alpha)))


def _picture(name: str, kind: str, file: str, space: str = "") -> str:
    colours = f" colorspace={quoteattr(space)}" if space else ""
    return (
        f'  <image name="{name}" type="{kind}">\n'
        f'    <input name="file" type="filename" value={quoteattr(file)}{colours} />\n'
        "  </image>"
    )


def _write(
    target: Path, package: Package, nodes: Iterable[str], inputs: Iterable[tuple[str, str, str]]
) -> None:
    document = _DOCUMENT.format(
        title=package.meta["title"].replace("--", "-").replace("<", "").replace("&", "and"),
        nodes="\n".join(nodes),
        inputs="\n".join(
            f'    <input name="{name}" type="{kind}" {value} />' for name, kind, value in inputs
        ),
    )
    (target / "material.mtlx").write_text(document, encoding="utf-8")


_MEANING = "a standard_surface of MaterialX with its maps"
FORMATS = (
    Format("materialx", ("neural_btf",), "", _MEANING, write_cloth),
    Format("materialx", ("glass_scratches",), "", _MEANING, write_glass),
)
