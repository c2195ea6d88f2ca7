"""A lit scene's package as USD's text."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from storage.packages import Package
from tsuya.exports.lit_materials import Material, index_of_refraction, materials_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

_WRAPS = ("repeat", "mirror", "clamp")
_DOME = "((0, 1, 0, 0), (0, 0, 1, 0), (1, 0, 0, 0), (0, 0, 0, 1))"
"""USD's dome has y up and the picture's middle at +z; ours has z up and the middle at +x."""


def scene_usda(package: Package) -> str:
    """The stage: a mesh with a subset a material, materials, a dome light. Raises BadInput."""
    materials = materials_of(package)
    parts = [
        _mesh(package, len(materials)),
        'def Scope "Materials"\n{\n'
        + "\n".join(_material(n, each) for n, each in enumerate(materials))
        + "}\n",
        _dome(package.parameter("exposure")),
    ]
    inside = _indented("\n".join(parts))
    return (
        '#usda 1.0\n(\n    defaultPrim = "Scene"\n    metersPerUnit = 1\n    upAxis = "Z"\n)\n\n'
        f'def Xform "Scene"\n{{\n{inside}}}\n'
    )


def _mesh(package: Package, count: int) -> str:
    import numpy as np

    mesh = package.mesh("mesh")
    assert mesh.normals is not None
    assert mesh.uvs is not None
    of_triangle = mesh.attributes["MATERIAL"][mesh.triangles[:, 0]]
    corners = " ".join(["3"] * len(mesh.triangles)).replace(" ", ", ")
    lines = [
        'def Mesh "Surfaces" (',
        '    prepend apiSchemas = ["MaterialBindingAPI"]',
        ")",
        "{",
        '    uniform token subdivisionScheme = "none"',
        "    uniform bool doubleSided = 1",
        f"    int[] faceVertexCounts = [{corners}]",
        f"    int[] faceVertexIndices = [{', '.join(map(str, mesh.triangles.reshape(-1)))}]",
        f"    point3f[] points = {_tuples(mesh.vertices)}",
        _primvar("normal3f", "normals", mesh.normals),
        _primvar("texCoord2f", "primvars:st", mesh.uvs),
        _primvar("texCoord2f", "primvars:st1", mesh.attributes["UV1"]),
        _primvar("color3f", "primvars:displayColor", mesh.attributes["PAINT"]),
        '    uniform token subsetFamily:materialBind:familyType = "partition"',
    ]
    for row in range(count):
        faces = np.flatnonzero(of_triangle == row)
        if len(faces):
            lines += _subset(row, faces)
    return "\n".join([*lines, "}", ""])


def _subset(row: int, faces: NDArray[Any]) -> list[str]:
    return [
        f'    def GeomSubset "Part{row}" (',
        '        prepend apiSchemas = ["MaterialBindingAPI"]',
        "    )",
        "    {",
        '        uniform token elementType = "face"',
        '        uniform token familyName = "materialBind"',
        f"        int[] indices = [{', '.join(map(str, faces.tolist()))}]",
        f"        rel material:binding = </Scene/Materials/Material{row}>",
        "    }",
    ]


def _primvar(kind: str, name: str, values: NDArray[Any]) -> str:
    return f'    {kind}[] {name} = {_tuples(values)} (\n        interpolation = "vertex"\n    )'


def _tuples(rows: NDArray[Any]) -> str:
    return f"[{', '.join(f'({_numbers(row)})' for row in rows.tolist())}]"


def _numbers(values: Iterable[float]) -> str:
    return ", ".join(f"{value:.9g}" for value in values)


def _material(number: int, made: Material) -> str:
    path = f"/Scene/Materials/Material{number}"
    surface = _Inputs(path, made)
    ior = index_of_refraction(made.specular)
    body = [
        f"token outputs:surface.connect = <{path}/Surface.outputs:surface>",
        'def Shader "Surface"\n{',
        '    uniform token info:id = "UsdPreviewSurface"',
        surface.colour(),
        surface.number("metallic", made.metallic, "b"),
        surface.number("roughness", made.roughness, "g"),
        f"    float inputs:ior = {ior:.9g}",
        surface.normal(),
        "    token outputs:surface\n}",
        *surface.readers(),
    ]
    inside = _indented("\n".join(line for line in body if line) + "\n")
    return f'def Material "Material{number}"\n{{\n{inside}}}\n'


class _Inputs:
    """Inputs of a surface: numbers, or connected to the shaders that read textures."""

    def __init__(self, path: str, made: Material) -> None:
        self._path, self._made = path, made

    def colour(self) -> str:
        """Its base colour."""
        if "colour" in self._made.maps:
            return f"    color3f inputs:diffuseColor.connect = <{self._path}/colour.outputs:rgb>"
        return f"    color3f inputs:diffuseColor = ({_numbers(self._made.base)})"

    def number(self, name: str, value: float, channel: str) -> str:
        """A number that a channel of the surface's texture may have."""
        if "surface" in self._made.maps:
            at = f"<{self._path}/surface.outputs:{channel}>"
            return f"    float inputs:{name}.connect = {at}"
        return f"    float inputs:{name} = {value:.9g}"

    def normal(self) -> str:
        """Bumps, where there are some."""
        if "normal" not in self._made.maps:
            return ""
        return f"    normal3f inputs:normal.connect = <{self._path}/normal.outputs:rgb>"

    def readers(self) -> list[str]:
        """The shaders that read textures and their coordinates."""
        made, found = self._made, []
        bend = made.bend
        scales = {
            "colour": (*made.base, 1.0),
            "surface": (1.0, made.roughness, made.metallic, 1.0),
            "normal": (2 * bend, 2 * bend, 2.0, 1.0),
        }
        for kind, own in made.maps.items():
            low = (-bend, -bend, -1.0, 0.0) if kind == "normal" else (0.0, 0.0, 0.0, 0.0)
            space = "sRGB" if kind == "colour" else "raw"
            across, along = (_WRAPS[mode] for mode in own.wrap)
            found.append(
                f'def Shader "{kind}Place"\n{{\n'
                '    uniform token info:id = "UsdPrimvarReader_float2"\n'
                f'    string inputs:varname = "{"st1" if own.mapping else "st"}"\n'
                "    float2 outputs:result\n}\n"
                f'def Shader "{kind}"\n{{\n'
                '    uniform token info:id = "UsdUVTexture"\n'
                f"    asset inputs:file = @./map_{own.number:03d}.png@\n"
                f"    float2 inputs:st.connect = <{self._path}/{kind}Place.outputs:result>\n"
                f'    token inputs:sourceColorSpace = "{space}"\n'
                f'    token inputs:wrapS = "{across}"\n    token inputs:wrapT = "{along}"\n'
                f"    float4 inputs:scale = ({_numbers(scales[kind])})\n"
                f"    float4 inputs:bias = ({_numbers(low)})\n"
                "    float3 outputs:rgb\n    float outputs:g\n    float outputs:b\n}"
            )
        return found


def _dome(exposure: float) -> str:
    return "\n".join(
        (
            'def DomeLight "Environment"',
            "{",
            f"    float inputs:intensity = {exposure:.9g}",
            "    asset inputs:texture:file = @./environment.exr@",
            '    token inputs:texture:format = "latlong"',
            f"    matrix4d xformOp:transform = {_DOME}",
            '    uniform token[] xformOpOrder = ["xformOp:transform"]',
            "}",
            "",
        )
    )


def _indented(text: str) -> str:
    return "".join(f"    {line}\n" if line else "\n" for line in text.splitlines())
