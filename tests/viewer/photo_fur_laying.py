"""A photograph laid over a body by Python, for the viewer's own tests:
`viewer/tests/photo_fur_laying.json`.

python -m tests.viewer.photo_fur_laying
"""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from assets_defs.workspace import CHECKOUT
from pipelines.photo_fur.lie_codes import hair_of_codes
from tests.fur_packages import packed_tufts

PATH = CHECKOUT / "viewer" / "tests" / "photo_fur_laying.json"
_DIGITS = 6


def values() -> dict[str, Any]:
    """What a package holds of the laying, and what follows from it: by corner of each triangle, for
    readers may number split vertices as they like."""
    packed = packed_tufts()
    mesh, patches, fur = packed.mesh, packed.patches, packed.fur()
    corners = fur.laying.triangles.ravel()
    tangents = hair_of_codes(packed.lie, mesh.normals, packed.backwards).tangents
    return {
        "vertices": _flat(mesh.vertices[-1], 9),
        "normals": _flat(mesh.normals.astype(np.float32), 9),
        "triangles": mesh.triangles.ravel().tolist(),
        "lie": packed.lie.ravel().tolist(),
        "backwards": packed.backwards.tolist(),
        "patches": {
            "middles": patches.middles.tolist(),
            "places": _flat(patches.places, 9),
            "directions": _flat(patches.directions, 9),
            "spacing": packed.spacing,
            "width": packed.width,
        },
        "expected": {
            "tangents": _flat(tangents),
            "count": len(fur.laying.vertex),
            "weights": _flat(fur.laying.weights[corners]),
            "uvs": _flat(fur.laying.uvs[corners] * (fur.laying.weights[corners] > 0)[..., None]),
        },
    }


def _flat(numbers: Any, digits: int = _DIGITS) -> list[float]:
    return [float(f"{number:.{digits}g}") for number in np.asarray(numbers).ravel()]


if __name__ == "__main__":
    PATH.write_text(json.dumps(values()) + "\n", encoding="ascii")
