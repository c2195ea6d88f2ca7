"""Values of parts as bytes of their files."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from storage.packages.glb import glb_bytes
from storage.packages.ktx2 import ktx2_bytes
from storage.packages.schema import ArrayPart, Mesh, MeshPart, Part, PicturePart

if TYPE_CHECKING:
    from numpy.typing import NDArray


def encoded(name: str, part: Part, value: Any) -> tuple[bytes, dict[str, Any]]:
    """A part's file, and what `meta.json` says of its values.

    value: an array, or a `Mesh`. Raises ValueError for what is not as declared.
    """
    if isinstance(part, MeshPart):
        return _encoded_mesh(name, part, value)
    array = _checked(name, part, value)
    if isinstance(part, ArrayPart):
        content = array.astype(array.dtype.newbyteorder("<"), copy=False).tobytes()
    elif isinstance(part, PicturePart):
        content = _png(array)
    else:
        content = ktx2_bytes(array)
    described = {"dtype": str(array.dtype), "shape": list(array.shape), "dims": list(part.dims)}
    return content, described


def _checked(name: str, part: Part, value: Any) -> NDArray[Any]:
    import numpy as np

    assert not isinstance(part, MeshPart)
    array = np.ascontiguousarray(value) if np.ndim(value) else np.asarray(value)
    if array.dtype != np.dtype(part.dtype):
        raise ValueError(f"part {name!r} is {array.dtype}; expected {part.dtype}.")
    if array.ndim != len(part.dims):
        raise ValueError(f"part {name!r} has shape {array.shape}; expected ({part.dims}).")
    if not isinstance(part, ArrayPart) and array.shape[-1] != part.channels:
        raise ValueError(f"part {name!r} has {array.shape[-1]} channels; expected {part.channels}.")
    if array.dtype.kind == "f" and not np.isfinite(array).all():
        raise ValueError(f"part {name!r} has values that are not finite; expected numbers.")
    return array


def _png(array: NDArray[Any]) -> bytes:
    import imagecodecs

    squeezed = array[..., 0] if array.shape[-1] == 1 else array
    return bytes(imagecodecs.png_encode(squeezed, level=9))


def _encoded_mesh(name: str, part: MeshPart, mesh: Mesh) -> tuple[bytes, dict[str, Any]]:
    if set(mesh.attributes) != set(part.attributes):
        raise ValueError(
            f"mesh {name!r} has attributes {sorted(mesh.attributes)}; "
            f"expected {sorted(part.attributes)}."
        )
    if (mesh.normals is not None, mesh.uvs is not None) != (part.normals, part.uvs):
        raise ValueError(
            f"mesh {name!r}: expected normals: {part.normals}, uvs: {part.uvs}, as declared."
        )
    described = {
        "vertices": len(mesh.vertices),
        "triangles": len(mesh.triangles),
        "attributes": {f"_{key}": meaning for key, meaning in part.attributes.items()},
    }
    return glb_bytes(mesh), described
