"""A glTF file as one mesh, with what its materials need."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from storage.readers.bad_input import BadInput
from storage.readers.gltf.accessors import Accessors
from storage.readers.gltf.assembly import Assembly
from storage.readers.gltf.buffers import Buffers
from storage.readers.gltf.container import opened
from storage.readers.gltf.document import checked
from storage.readers.gltf.extensions import check_required, check_version
from storage.readers.gltf.notes import document_notes, mesh_notes
from storage.readers.gltf.scene_tree import groups, scene_tree, world_matrices
from storage.readers.gltf.sizes import check_sizes
from storage.readers.polygons import PolygonMesh


@dataclass(frozen=True)
class GltfFile:
    """What a glTF's scene shows.

    mesh: all triangles where the nodes place them; ``parts`` are rows of ``primitives``;
    ``corner_uvs`` is TEXCOORD_0, (nan, nan) where a primitive has none; ``corner_colours`` is
    COLOR_0, 1 where a primitive has none; both None where no primitive has any.
    primitives: the JSON of each primitive of the file, of one mesh after the other.
    document: the whole JSON; what this reader reads of it is checked, materials are not.
    uvs: by the number of their set, of each corner (corners, 2) float64 with v from the bottom; 0
    where a primitive does not have the set.
    """

    mesh: PolygonMesh
    primitives: list[dict[str, Any]]
    document: dict[str, Any]
    uvs: dict[int, NDArray[np.float64]]
    _buffers: Buffers = field(repr=False)

    def image(self, number: int) -> bytes:
        """The encoded picture of ``images[number]``: embedded, or a file beside.

        Raises BadInput where there is none, or where it is missing.
        """
        return self._buffers.image(number)


def read_gltf(file: Path) -> GltfFile:
    """Read a .glb or a .gltf file: glTF 2.0, with the files beside it that it names.

    The scene that the file wants shown is read (else its first; without scenes, all nodes), with
    instances, skins in their rest pose and morph targets by the file's weights; primitives of
    triangles, strips and fans, packed by Draco, meshopt or as integers, too. Mirroring nodes turn
    their triangles over. What is left out the mesh's ``notes`` say.

    Raises BadInput for a file that is truncated, damaged, of another version or takes too much
    memory, whose scene has no triangles, whose buffers are missing or on the network, and that
    requires an unknown extension.
    """
    container = opened(file)
    check_version(file, container.description)
    document = checked(file, container.description)
    check_required(file, document)
    buffers = Buffers(file, document, container)
    accessors = Accessors(buffers)
    tree = scene_tree(file, document)
    drawn = groups(document, tree)
    check_sizes(document, accessors, drawn)
    with np.errstate(all="ignore"):  # what is not finite is found by whoever uses the mesh
        assembly = Assembly(accessors, world_matrices(document, tree))
        for group in drawn:
            assembly.place(group)
    said = document_notes(document, tree, drawn, assembly.flat)
    said += mesh_notes(document, drawn, assembly.leftover, assembly.clamped)
    mesh, uvs = assembly.joined(tuple(said))
    if len(mesh.sizes) == 0:
        found = f"without triangles: {said[0]}" if said else "without triangles in its scene"
        expected = "a scene with triangles: export the mesh in it (of points, make a mesh before)"
        raise BadInput(file, "content", found.rstrip("."), expected)
    return GltfFile(mesh, assembly.primitives, document, uvs, buffers)
