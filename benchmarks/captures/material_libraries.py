"""Material libraries of OBJ files: spelling, numbers, and how they name textures."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from benchmarks.captures.case import Case
from benchmarks.captures.looks import (
    GREEN,
    GREY,
    RED,
    encoded,
    has,
    picture,
    shows,
)
from storage.readers.scenes import read_scene

SQUARE = """mtllib {library}
v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
vt 0 0
vt 1 0
vt 1 1
vt 0 1
usemtl wood
f 1/1 2/2 3/3 4/4
"""
COLOURED = """mtllib {library}
v 0 0 0 1 0 0.50196
v 1 0 0 1 0 0.50196
v 1 1 0 1 0 0.50196
v 0 1 0 1 0 0.50196
usemtl wood
f 1 2 3 4
"""
PICTURE = encoded(picture())
Files = Mapping[str, bytes]
_OAK: Files = {"oak.png": PICTURE}


def library_case(
    name: str,
    kind: str,
    library: str,
    ends: Any = "read",
    says: tuple[str, ...] = (),
    is_right: Callable[[Any], bool] | None = None,
    *,
    files: Files = _OAK,
    mesh: str = SQUARE,
) -> Case:
    """A square with a library beside it and other files."""

    def write(path: Path) -> None:
        mtl = f"{path.stem}.mtl"
        path.write_text(mesh.replace("{library}", mtl))
        path.with_suffix(".mtl").write_text("newmtl wood\n" + library + "\n")
        for beside, data in files.items():
            (path.parent / beside).parent.mkdir(exist_ok=True)
            (path.parent / beside).write_bytes(data)

    return Case(name, kind, read_scene, ends, says, is_right, write)


def _utf16(path: Path) -> None:
    path.write_text(SQUARE.replace("{library}", "wide.mtl"))
    (path.parent / "wide.mtl").write_text("newmtl wood\nKd 0.1 0.2 0.3\n", "utf-16")


def _several(path: Path) -> None:
    path.write_text("mtllib one.mtl\n" + SQUARE.replace("{library}", "two.mtl"))
    (path.parent / "one.mtl").write_text("newmtl other\nKd 0 1 0\n")
    (path.parent / "two.mtl").write_text("newmtl wood\nKd 0.1 0.2 0.3\n")


_LAPTOP = "map_Kd C:\\Users\\me\\my textures\\oak.png"

CASES = (
    Case(
        "obj_kd_black_map.obj",
        "texture is missing",
        read_scene,
        "told",
        ("skin.png is missing",),
        has(albedo=(0.6, 0.6, 0.6)),
    ),
    Case(
        "obj_kd_over_one.obj",
        "number a little outside",
        read_scene,
        "told",
        ("Ks .* held",),
        has(albedo=(1, 1, 1)),
    ),
    library_case("obj_map.obj", "texture of an MTL", "Kd 1 1 1\nmap_Kd oak.png", is_right=shows()),
    library_case(
        "obj_kd_black.obj", "black with a texture", "Kd 0 0 0\nmap_Kd oak.png", is_right=shows()
    ),
    library_case("obj_no_kd.obj", "black with a texture", "map_Kd oak.png", is_right=shows()),
    library_case(
        "obj_kd_times.obj",
        "colour times a texture",
        "Kd 0.5 0.25 1\nmap_Kd oak.png",
        is_right=shows(times=(0.5, 0.25, 1)),
    ),
    library_case(
        "obj_scale.obj",
        "texture options",
        "Kd 1\nmap_Kd -s 2 2 1 oak.png",
        is_right=shows({(0.125, 0.875): RED, (0.625, 0.375): RED, (0.375, 0.625): GREY}),
    ),
    library_case(
        "obj_offset.obj",
        "texture options",
        "Kd 1\nmap_Kd -o 0.5 0 0 oak.png",
        is_right=shows({(0.25, 0.75): GREEN, (0.75, 0.75): RED}),
    ),
    library_case(
        "obj_clamp.obj",
        "texture options",
        "Kd 1\nmap_Kd -clamp on -s 2 2 2 oak.png",
        is_right=shows({(0.125, 0.375): RED, (0.75, 0.75): GREEN}),
    ),
    library_case(
        "obj_gain.obj",
        "texture options",
        "Kd 1\nmap_Kd -mm 0.25 0.5 oak.png",
        is_right=shows({(0.75, 0.25): (round(255 * (0.25 + 0.5 * 128 / 255)),) * 3}),
    ),
    library_case(
        "obj_many_options.obj",
        "texture options",
        "Kd 1\nmap_Kd -blendu on -texres 512 -cc off -o 0.5 oak.png",
        is_right=shows({(0.25, 0.75): GREEN}),
    ),
    library_case(
        "obj_turbulence.obj",
        "texture options",
        "Kd 1\nmap_Kd -t 0.1 0.1 0.1 oak.png",
        "told",
        ("turbulence of its texture oak.png is not used",),
        shows(),
    ),
    library_case(
        "obj_spaces.obj",
        "name of a texture",
        "Kd 1\nmap_Kd my old oak.png",
        is_right=shows(),
        files={"my old oak.png": PICTURE},
    ),
    library_case("obj_quoted.obj", "name of a texture", 'Kd 1\nmap_Kd "oak.png"', is_right=shows()),
    library_case("obj_windows.obj", "name of a texture", f"Kd 1\n{_LAPTOP}", is_right=shows()),
    library_case(
        "obj_backslash.obj",
        "name of a texture",
        "Kd 1\nmap_Kd tex\\oak.png",
        is_right=shows(),
        files={"tex/oak.png": PICTURE},
    ),
    library_case(
        "obj_tabs.obj", "spelling of an MTL", "\tKd\t1\t1\t1\n\tmap_Kd\toak.png", is_right=shows()
    ),
    library_case(
        "obj_capitals.obj", "spelling of an MTL", "KD 1 1 1\nMAP_KD oak.png", is_right=shows()
    ),
    library_case(
        "obj_commas.obj",
        "spelling of an MTL",
        "Kd 0,1 0,2 0,3",
        is_right=has(albedo=(0.1, 0.2, 0.3)),
    ),
    Case(
        "obj_wide.obj",
        "spelling of an MTL",
        read_scene,
        "read",
        (),
        has(albedo=(0.1, 0.2, 0.3)),
        _utf16,
    ),
    Case(
        "obj_two_libraries.obj",
        "several libraries",
        read_scene,
        "read",
        (),
        has(albedo=(0.1, 0.2, 0.3)),
        _several,
    ),
)
