"""What files hold as other libraries see it, and what of that our readers drop without a word.

Independent of our readers: OpenEXR, Pillow, tifffile, trimesh, the standard library's JSON, ZIP and
CSV. A thing found in a file is fine where the product uses it (``USED``) or a note says it.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from pathlib import Path

from benchmarks.captures import second_images, second_meshes, second_tables

Found = dict[str, str]
"""Things by one of the names in ``SAID``, and what they are in this file."""

SAID: dict[str, str] = {
    "alpha": r"alpha|transparen",
    "animation": r"animation",
    "attribute": r"attribute|propert",
    "camera": r"camera",
    "channels": r"channel|layer|alpha",
    "colours": r"colour",
    "curves": r"free-form|surface",
    "element": r"\brows?\b|only .*(vertices|polygons|faces)",
    "emission": r"emit|emissi",
    "extension": r"extension|KHR_|EXT_|variant|levels of detail|without light|hidden|emits",
    "film": r"film|motion|video",
    "hidden": r"hidden",
    "light": r"\blights?\b",
    "lines": r"\blines?\b|\bpoints?\b",
    "mesh": r"mesh.* not in the scene",
    "morph": r"morph",
    "occlusion": r"occlusion",
    "pages": r"pages?|animation|picture|frames?|layers",
    "parts": r"layer|channel|part\b",
    "preview": r"preview|smaller",
    "scene": r"scene",
    "skin": r"skin",
    "table": r"table|profiles",
    "columns": r"columns?",
    "files": r"files?\b",
    "texture": r"texture",
    "window": r"window",
}
"""What a note says of a thing, without regard to case."""

USED: dict[str, frozenset[str]] = {
    "materials": frozenset({"colours", "texture"}),
    "light_probes": frozenset({"window"}),
}
"""What the product takes of the files of a group of cases."""

_FINDERS: dict[str, Callable[[Path], Found]] = {
    ".exr": second_images.in_exr,
    ".tif": second_images.in_tiff,
    ".tiff": second_images.in_tiff,
    **dict.fromkeys(
        (".png", ".jpg", ".jpeg", ".webp", ".avif", ".gif", ".bmp"), second_images.in_picture
    ),
    ".glb": second_meshes.in_gltf,
    ".gltf": second_meshes.in_gltf,
    ".obj": second_meshes.in_obj,
    ".ply": second_meshes.in_ply,
    ".stl": second_meshes.in_stl,
    **dict.fromkeys((".csv", ".txt", ".tsv", ".dat", ".asc"), second_tables.in_table),
    ".sdf": second_tables.in_sdf,
    ".zip": second_tables.in_archive,
}


def silent(path: Path, group: str, notes: Sequence[str], reading: object = None) -> list[str]:
    """What a file of a group of cases holds that is neither used nor in a note, in words.

    ``reading``: what was read of it; colours that it has are not dropped.
    """
    used = USED.get(group, frozenset())
    mesh = getattr(reading, "mesh", reading)
    if getattr(mesh, "corner_colours", None) is not None:
        used |= {"colours"}
    return [
        f"{thing}: {what}"
        for thing, what in found_in(path).items()
        if thing not in used and not any(_says(note, thing) for note in notes)
    ]


def found_in(path: Path) -> Found:
    """What another library finds in a file beside the one picture, mesh, profile that is read."""
    finder = _FINDERS.get(path.suffix.lower())
    return finder(path) if finder is not None else {}


def _says(note: str, thing: str) -> bool:
    return re.search(SAID[thing], note, re.IGNORECASE) is not None
