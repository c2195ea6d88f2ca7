"""What a package holds: parts and parameters, declared once a system.

The declaration checks what is written, makes `docs/packages.md`, and stands in each package's
`meta.json` as the meaning of its parts.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from typing import TYPE_CHECKING, Any, ClassVar

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


@dataclass(frozen=True)
class Mesh:
    """A triangle mesh of a package; z is up."""

    vertices: NDArray[np.float32]
    """(V, 3)."""
    triangles: NDArray[np.uint32]
    """(F, 3) vertex numbers, counter-clockwise from outside."""
    normals: NDArray[np.float32] | None = None
    """(V, 3)."""
    uvs: NDArray[np.float32] | None = None
    """(V, 2), origin bottom left, as ours; glTF's own v counts from the top: files hold 1 - v."""
    attributes: Mapping[str, NDArray[np.float32]] = field(default_factory=dict)
    """Further values of the vertices, (V,) or (V, k) with k <= 4, by names in capitals."""


@dataclass(frozen=True)
class ArrayPart:
    """An array as little-endian values in C order, a file `.bin`."""

    kind: ClassVar[str] = "array"
    suffix: ClassVar[str] = ".bin"
    dims: tuple[str, ...]
    dtype: str
    """An integer of 8 to 32 bits, float16 or float32."""
    units: str
    meaning: str
    """One line; ends without a full stop."""
    source: str = ""
    """Paper and equation, where there is one."""
    optional: bool = False


@dataclass(frozen=True)
class PicturePart:
    """A picture (y, x, channel), row 0 at the top, as a PNG of its codes: no profile, no gamma."""

    kind: ClassVar[str] = "picture"
    suffix: ClassVar[str] = ".png"
    meaning: str
    channels: int = 3
    dtype: str = "uint8"
    """uint8 or uint16."""
    units: str = "sRGB code"
    source: str = ""
    optional: bool = False

    @property
    def dims(self) -> tuple[str, ...]:
        """Of the values."""
        return ("y", "x", "channel")


@dataclass(frozen=True)
class TexturesPart:
    """Layers of texels (layer, y, x, channel), row 0 at the top, as a KTX 2 array texture."""

    kind: ClassVar[str] = "textures"
    suffix: ClassVar[str] = ".ktx2"
    meaning: str
    channels: int = 4
    dtype: str = "uint8"
    """uint8, uint16 (as normalised integers), float16 or float32."""
    units: str = "1"
    source: str = ""
    optional: bool = False

    @property
    def dims(self) -> tuple[str, ...]:
        """Of the values."""
        return ("layer", "y", "x", "channel")


@dataclass(frozen=True)
class MeshPart:
    """A mesh as binary glTF 2.0: its arrays as they are, z up, under a node that turns z to y."""

    kind: ClassVar[str] = "mesh"
    suffix: ClassVar[str] = ".glb"
    meaning: str
    units: str = "scene unit"
    attributes: Mapping[str, str] = field(default_factory=dict)
    """Meaning of further values of the vertices, by names in capitals; in the file `_NAME`."""
    normals: bool = True
    uvs: bool = True
    source: str = ""
    optional: bool = False


Part = ArrayPart | PicturePart | TexturesPart | MeshPart


@dataclass(frozen=True)
class Parameter:
    """A number, a text or a list of numbers in `meta.json`."""

    units: str
    meaning: str
    source: str = ""


@dataclass(frozen=True)
class PackageSchema:
    """One system's package."""

    system: str
    number: int
    """Raised whenever a reader of the old form would read the new one wrongly."""
    meaning: str
    parts: Mapping[str, Part]
    """By name; ``*`` in a name stands for what differs among many: ``tile_*/masks``. Every package
    may hold more pictures, ``reference_*``, ``poster`` and ``input``, which need no declaration."""
    parameters: Mapping[str, Parameter] = field(default_factory=dict)
    decoding: str = ""
    """Markdown: how a reader gets from the parts to radiance."""

    def part(self, name: str) -> Part:
        """The declaration of a part. Raises KeyError for a name that is not declared."""
        for pattern, part in (*self.parts.items(), *_COMMON.items()):
            if fnmatchcase(name, pattern):
                return part
        raise KeyError(f"{self.system}: part {name!r} is not declared.")

    def missing(self, values: Mapping[str, Any]) -> list[str]:
        """Names, or patterns, of what is declared and not there, without what is optional."""
        return [
            pattern
            for pattern, part in (*self.parts.items(), *_COMMON.items())
            if not part.optional and not any(fnmatchcase(name, pattern) for name in values)
        ]


_COMMON: Mapping[str, Part] = {
    "poster": PicturePart("What the package looks like, drawn by the stage"),
    "input": PicturePart("What was measured or given"),
    "reference_*": PicturePart("A frame of the stage, for one of the views", optional=True),
}
