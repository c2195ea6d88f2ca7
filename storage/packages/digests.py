"""Our reader as a command of the conformance suite: `python -m storage.packages.digests PATH`."""

from __future__ import annotations

import json
import sys
from typing import Any

from storage.packages.reading import read_package
from storage.packages.schema import Mesh


def digests(path: str) -> dict[str, str]:
    """SHA-256 of the values of each part of a package. Raises BadInput."""
    import numpy as np

    from storage.packages.conformance import digest

    package = read_package(path)
    found = {}
    for name in package.parts:
        value = package.value(name)
        if not isinstance(value, Mesh):
            found[name] = digest(value)
            continue
        arrays: dict[str, Any] = {"POSITION": value.vertices, "indices": value.triangles}
        if value.normals is not None:
            arrays["NORMAL"] = value.normals
        if value.uvs is not None:
            arrays["TEXCOORD_0"] = np.stack([value.uvs[:, 0], 1 - value.uvs[:, 1]], axis=1)
        arrays |= {f"_{key}": each for key, each in value.attributes.items()}
        found |= {f"{name}/{key}": digest(each) for key, each in arrays.items()}
    return found


if __name__ == "__main__":
    try:
        print(json.dumps({"parts": digests(sys.argv[1])}))
    except ValueError as error:
        sys.exit(str(error))
