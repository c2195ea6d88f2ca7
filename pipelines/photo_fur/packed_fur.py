"""The fur as a package holds it: all that follows from the rest is left out.

The photograph is an AVIF, of which depths are read again; the hair's directions have a byte a
vertex; of patches only where they are and what they show is kept, for readers to lay them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipelines.photo_fur.attenuation import Attenuation
from pipelines.photo_fur.laid_fur import Hair, LaidFur, laid_fur
from pipelines.photo_fur.laying import Body, Patches, lay
from pipelines.photo_fur.lie_codes import hair_of_codes, lie_codes
from pipelines.photo_fur.packed_photograph import packed_photograph, unpacked_photograph
from pipelines.photo_fur.photograph import FurPhotograph
from pipelines.photo_fur.shells import ShellMesh


class Laid(NamedTuple):
    """How hair lies on a mesh, and which patches of the photograph do."""

    hair: Hair
    backwards: NDArray[np.floating]
    """(3,): from nose to tail."""
    patches: Patches
    spacing: float
    """Between patches' middles, mesh units."""
    width: float
    """Of the photograph on the surface, mesh units."""


class PackedFur(NamedTuple):
    """What a package holds."""

    file: bytes
    """The photograph, AVIF."""
    opaque: NDArray[np.bool_] | None
    """(y, x): where there is fur; None for everywhere."""
    attenuation: Attenuation
    mesh: ShellMesh
    lie: NDArray[np.uint8]
    """(2, V): codes of the hair's direction and length."""
    backwards: NDArray[np.floating]
    patches: Patches
    spacing: float
    width: float

    def photograph(self) -> FurPhotograph:
        """As it is read back. Raises ValueError where the file is none."""
        return unpacked_photograph(self.file, self.attenuation, self.opaque)

    def fur(self) -> LaidFur:
        """The photograph laid over the mesh, as it is drawn."""
        mesh = self.mesh
        hair = hair_of_codes(self.lie, mesh.normals, self.backwards)
        body = Body(mesh.vertices[-1], mesh.triangles, hair.tangents, mesh.normals)
        laying = lay(body, self.patches, spacing=self.spacing, width=self.width)
        return laid_fur(mesh.vertices[-1], mesh.normals, hair, laying, mesh.thickness, mesh.layers)


def packed_fur(photograph: FurPhotograph, mesh: ShellMesh, laid: Laid, quality: int) -> PackedFur:
    """The fur to be packed; quality: of the photograph, 0 to 100."""
    places, directions = laid.patches.places, laid.patches.directions
    return PackedFur(
        packed_photograph(photograph, quality),
        photograph.opaque,
        photograph.attenuation,
        mesh,
        lie_codes(laid.hair, mesh.normals, laid.backwards),
        laid.backwards,
        laid.patches._replace(
            places=places.astype(np.float32), directions=directions.astype(np.float32)
        ),
        laid.spacing,
        laid.width,
    )
