"""What textures of material libraries stand for, their formats; colours and textures of PLY."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from benchmarks.captures.case import Case
from benchmarks.captures.looks import (
    BLUE,
    CORNERS,
    GREY,
    MIDDLE,
    RED,
    Seen,
    both,
    encoded,
    has,
    is_everywhere,
    linear,
    picture,
    plain,
    shows,
)
from benchmarks.captures.material_libraries import COLOURED, PICTURE, SQUARE, library_case
from storage.readers.scenes import read_scene


def _partly_mapped(scene: Any) -> bool:
    """Another part, without texture coordinates, takes nothing from the first."""
    left = Seen(scene, (0.25, 0.75)).base()
    return bool(np.allclose(left, linear(RED), atol=0.01)) and len(scene.triangles) == 4


def _bends(scene: Any) -> bool:
    codes = Seen(scene, (0.25, 0.75)).codes("normal")
    return codes is not None and codes.tolist() == list(MIDDLE)


def _shares(channel: int, value: float) -> Callable[[Any], bool]:
    return lambda scene: abs(Seen(scene, (0.25, 0.75)).share(channel) - value) < 0.01


def _exponent(scene: Any) -> bool:
    """Ns 200 times 128 / 255: the slope of that exponent."""
    seen = Seen(scene, (0.25, 0.75))
    slope = (seen.material.varying.roughness * seen.share(1)) ** 2
    return abs(slope - (2 / (200 * 128 / 255 + 2)) ** 0.5) < 0.01


def _averaged(scene: Any) -> bool:
    """Black and white lines, a texel wide each: half of the light, not half of the code."""
    texels = scene.materials[0].varying.colour.texels
    return texels.shape[:2] == (2, 2048) and abs(linear(texels[0, 0])[0] - 0.5) < 0.01


_LINES = encoded(Image.fromarray((np.indices((4, 4096)).sum(0) % 2 * 255).astype(np.uint8)))
_GREY16 = encoded(Image.fromarray(np.full((8, 8), 128 * 257, np.uint16)))
_PALETTE = encoded(picture().quantize(8))
_CMYK = encoded(plain((200, 30, 20)).convert("CMYK"), "JPEG")

LIBRARIES = (
    library_case(
        "obj_normals.obj",
        "normal texture",
        "Kd 1\nnorm flat.png",
        is_right=_bends,
        files={"flat.png": encoded(plain(MIDDLE))},
    ),
    library_case(
        "obj_bump_normals.obj",
        "normal texture",
        "Kd 1\nmap_Bump -bm 0.5 flat.png",
        is_right=both(_bends, has(bend=0.5)),
        files={"flat.png": encoded(plain(MIDDLE))},
    ),
    library_case(
        "obj_bump_heights.obj",
        "heights",
        "Kd 0.5\nmap_bump rough.png",
        "told",
        ("rough.png holds heights: it is not used",),
        has(albedo=(0.5,) * 3),
        files={"rough.png": encoded(plain((90, 90, 90)))},
    ),
    library_case(
        "obj_roughness.obj",
        "texture of roughness or metal",
        "Kd 1\nmap_Pr r.png",
        is_right=_shares(1, 64 / 255),
        files={"r.png": encoded(plain((64, 64, 64)))},
    ),
    library_case(
        "obj_metal.obj",
        "texture of roughness or metal",
        "Kd 1\nPm 1\nmap_Pm r.png",
        is_right=both(_shares(2, 64 / 255), has(metal=1)),
        files={"r.png": encoded(plain((64, 64, 64)))},
    ),
    library_case(
        "obj_exponents.obj",
        "texture of gloss",
        "Kd 1\nKs 0.5\nNs 200\nmap_Ns r.png",
        is_right=_exponent,
        files={"r.png": encoded(plain((128, 128, 128)))},
    ),
    library_case(
        "obj_speculars.obj",
        "texture of gloss",
        "Kd 1\nKs 0.5\nmap_Ks r.png",
        is_right=_shares(0, float(linear((128,))[0])),
        files={"r.png": encoded(plain((128, 128, 128)))},
    ),
    library_case(
        "obj_opacity_map.obj",
        "transparency",
        "Kd 1\nmap_Kd oak.png\nmap_d oak.png",
        "told",
        ("texture of how opaque it is, oak.png, is not used",),
        shows(),
    ),
    library_case(
        "obj_glass.obj",
        "transparency",
        "Kd 0.5\nd 0.25",
        "told",
        ("drawn opaque",),
        has(albedo=(0.5,) * 3),
    ),
    library_case(
        "obj_max_tr.obj", "transparency", "Kd 0.5\nd 1\nTr 1", is_right=has(albedo=(0.5,) * 3)
    ),
    library_case(
        "obj_lamp.obj",
        "emission",
        "Kd 0.5\nKe 5 5 5",
        "told",
        ("emits light",),
        has(albedo=(0.5,) * 3),
    ),
    library_case(
        "obj_no_highlight.obj",
        "illumination model",
        "Kd 0.5\nKs 0.5\nillum 1",
        is_right=has(specular=0),
    ),
    library_case(
        "obj_gold.obj",
        "colour of a metal",
        "Kd 0 0 0\nKs 0.9 0.6 0.3\nNs 50",
        is_right=has(specular=0.6, tint=(1.5, 1, 0.5)),
    ),
    library_case(
        "obj_xyz.obj",
        "colour space of a number",
        "Kd xyz 0.4124 0.2126 0.0193",
        "told",
        ("CIE XYZ",),
        has(albedo=(1, 0, 0)),
    ),
    library_case(
        "obj_bytes.obj",
        "colour space of a number",
        "Kd 255 51 0",
        "told",
        ("0 to 255",),
        has(albedo=(1, 0.2, 0)),
    ),
    library_case(
        "obj_spectrum.obj",
        "colour space of a number",
        "Kd spectral oak.rfl 1",
        "told",
        ("spectrum in a file",),
        has(albedo=(0.6,) * 3),
    ),
    library_case(
        "obj_lost_texture.obj",
        "texture is missing",
        "Kd 0.5\nmap_Kd gone.png",
        "told",
        ("gone.png is missing",),
        has(albedo=(0.5,) * 3),
    ),
    library_case(
        "obj_broken_texture.obj",
        "texture is damaged",
        "Kd 0.5\nmap_Kd oak.png",
        "told",
        ("oak.png is left out",),
        has(albedo=(0.5,) * 3),
        files={"oak.png": PICTURE[:60]},
    ),
    library_case(
        "obj_psd_texture.obj",
        "texture is damaged",
        "Kd 0.5\nmap_Kd oak.psd",
        "told",
        ("oak.psd is left out: .*convert it to PNG",),
        has(albedo=(0.5,) * 3),
        files={"oak.psd": b"8BPS" + bytes(60)},
    ),
    library_case(
        "obj_unmapped.obj",
        "texture without coordinates",
        "Kd 0.5\nmap_Kd oak.png",
        "told",
        ("no texture coordinates",),
        has(albedo=(0.5,) * 3),
        mesh=SQUARE.replace("f 1/1 2/2 3/3 4/4", "f 1 2 3 4"),
    ),
    library_case(
        "obj_partly_mapped.obj",
        "texture without coordinates",
        "Kd 1\nmap_Kd oak.png",
        "told",
        ("'bare' is in no material library",),
        _partly_mapped,
        mesh=SQUARE + "usemtl bare\nv 2 0 0\nv 3 0 0\nv 3 1 0\nv 2 1 0\nf 5 6 7 8\n",
    ),
    library_case(
        "obj_targa.obj",
        "format of a texture",
        "Kd 1\nmap_Kd oak.tga",
        is_right=shows(),
        files={"oak.tga": encoded(picture(), "TGA")},
    ),
    library_case(
        "obj_bmp.obj",
        "format of a texture",
        "Kd 1\nmap_Kd oak.bmp",
        is_right=shows(),
        files={"oak.bmp": encoded(picture(), "BMP")},
    ),
    library_case(
        "obj_webp.obj",
        "format of a texture",
        "Kd 1\nmap_Kd oak.webp",
        is_right=shows(),
        files={"oak.webp": encoded(picture(), "WEBP", lossless=True)},
    ),
    library_case(
        "obj_palette.obj",
        "format of a texture",
        "Kd 1\nmap_Kd oak.png",
        is_right=shows(),
        files={"oak.png": _PALETTE},
    ),
    library_case(
        "obj_grey16.obj",
        "format of a texture",
        "Kd 1\nmap_Kd oak.png",
        is_right=is_everywhere(linear(GREY)),
        files={"oak.png": _GREY16},
    ),
    library_case(
        "obj_cmyk.obj",
        "format of a texture",
        "Kd 1\nmap_Kd oak.jpg",
        is_right=is_everywhere(linear(RED), 0.05),
        files={"oak.jpg": _CMYK},
    ),
    library_case(
        "obj_large.obj",
        "large texture",
        "Kd 1\nmap_Kd lines.png",
        "told",
        ("averaged down to 2048",),
        _averaged,
        files={"lines.png": _LINES},
    ),
    library_case(
        "obj_coloured.obj",
        "colours of vertices",
        "Kd 0.5 1 1",
        is_right=is_everywhere(linear((255, 0, 128)) * (0.5, 1, 1)),
        mesh=COLOURED,
    ),
)


# ---- PLY ---------------------------------------------------------------------------------------


def _ply(texture: bool, colours: bool) -> Callable[[Path], None]:
    header = ["ply", "format ascii 1.0"] + ["comment TextureFile oak.png"] * texture
    header += ["element vertex 4", *(f"property float {axis}" for axis in "xyz")]
    header += [f"property uchar {name}" for name in ("red", "green", "blue")] * colours
    header += ["property float s", "property float t"] * texture
    header += ["element face 1", "property list uchar int vertex_indices", "end_header"]

    def write(path: Path) -> None:
        (path.parent / "oak.png").write_bytes(PICTURE)
        rows = [
            f"{x} {y} 0" + " 200 30 20" * colours + f" {x} {y}" * texture
            for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))
        ]
        path.write_text("\n".join([*header, *rows, "4 0 1 2 3"]) + "\n")

    return write


def _is_of_ply(scene: Any) -> bool:
    """Colours of the file's own numbers, taken apart by hand."""
    import trimesh

    from benchmarks.captures.case import FILES

    mesh: Any = trimesh.load(FILES / "ply_vertex_colours.ply", process=False)
    expected = linear(mesh.visual.vertex_colors[mesh.faces][..., :3]).mean(axis=(0, 1))
    return bool(np.allclose(scene.materials[0].albedo, expected, atol=0.01))


PLY = (
    Case("ply_vertex_colours.ply", "colours of vertices", read_scene, "read", (), _is_of_ply),
    Case(
        "ply_coloured.ply",
        "colours of vertices",
        read_scene,
        "read",
        (),
        is_everywhere(linear(RED)),
        _ply(False, True),
    ),
    Case(
        "ply_textured.ply",
        "texture of a PLY",
        read_scene,
        "read",
        (),
        shows(CORNERS),
        _ply(True, False),
    ),
    Case(
        "ply_textured_and_coloured.ply",
        "texture of a PLY",
        read_scene,
        "read",
        (),
        shows({(0.25, 0.25): BLUE}, linear(RED)),
        _ply(True, True),
    ),
)

CASES = (*LIBRARIES, *PLY)
