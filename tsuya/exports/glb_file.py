"""A .glb of several arrays and pictures: what exports put their meshes and textures into."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from storage.packages.glb import container

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

_TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}


class GlbFile:
    """The buffer of a .glb, its views and accessors."""

    def __init__(self) -> None:
        self._content = bytearray()
        self._views: list[dict[str, int]] = []
        self._accessors: list[dict[str, Any]] = []

    def values(self, array: NDArray[Any]) -> int:
        """The number of an accessor of floats (N,) or (N, k)."""
        import numpy as np

        stored = np.ascontiguousarray(array, "<f4")
        rows = stored.reshape(len(stored), -1)
        return self._accessor(
            {
                "bufferView": self._view(stored.tobytes()),
                "componentType": 5126,
                "count": len(rows),
                "type": _TYPES[rows.shape[1]],
                "min": rows.min(axis=0).tolist(),
                "max": rows.max(axis=0).tolist(),
            }
        )

    def indices(self, corners: NDArray[np.integer]) -> int:
        """The number of an accessor of vertex numbers."""
        stored = corners.reshape(-1).astype("<u4")
        made = {"bufferView": self._view(stored.tobytes()), "componentType": 5125}
        return self._accessor(made | {"count": len(stored), "type": "SCALAR"})

    def picture(self, codes: NDArray[np.uint8]) -> int:
        """The number of a view that holds a picture as PNG."""
        import imagecodecs

        return self._view(bytes(imagecodecs.png_encode(codes)))

    def whole(self, document: dict[str, Any]) -> bytes:
        """The file."""
        buffers = {"buffers": [{"byteLength": len(self._content)}]}
        parts = {"bufferViews": self._views, "accessors": self._accessors}
        return container(document | buffers | parts, bytes(self._content))

    def _view(self, content: bytes) -> int:
        self._views.append(
            {"buffer": 0, "byteOffset": len(self._content), "byteLength": len(content)}
        )
        self._content += content + b"\0" * (-len(content) % 4)
        return len(self._views) - 1

    def _accessor(self, made: dict[str, Any]) -> int:
        self._accessors.append(made)
        return len(self._accessors) - 1
