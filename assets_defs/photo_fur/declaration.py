"""The system: photographs, meshes, and what can be made at all."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import Field

from assets_defs.sources import Source
from assets_defs.system import Dimension, System
from pipelines.photo_fur.attenuation import MOST_LAYERS
from storage.readers.meshes import read_mesh
from storage.readers.photographs import BUILTIN_PHOTOGRAPHS, SUFFIXES, read_photograph

PELT = "pelt"
SQUARE = "square"
Layers = Annotated[int, Field(ge=1, le=MOST_LAYERS, description="Layers of shells, N")]


def _check_photograph(source: Source, settings: Mapping[str, Any]) -> None:
    if source.path is not None:
        read_photograph(source.path, settings.get("crop"))
    elif settings.get("crop") is not None:
        raise ValueError(f"crop is set for {source.name}; expected a photograph of yours.")


def _check_mesh(source: Source, settings: Mapping[str, Any]) -> None:
    from pipelines.geometry.repair import repair_mesh

    if source.path is not None:
        vertices, triangles, *_ = read_mesh(source.path)
        try:
            repair_mesh(vertices, triangles)
        except ValueError as error:
            raise ValueError(f"{source.name}: {error}.") from error


FUR = System(
    name="photo_fur",
    title="Fur from one photograph",
    dimensions=(
        Dimension(
            "photo",
            builtin=(*BUILTIN_PHOTOGRAPHS, PELT),
            examples=("grass",),
            default=PELT,
            suffixes=SUFFIXES,
            check=_check_photograph,
        ),
        Dimension(
            "mesh",
            builtin=(SQUARE, "sphere", "teapot", "teapot-large", "animal"),
            examples=("teapot",),
            default="teapot",
            suffixes=(".ply", ".obj", ".stl", ".glb", ".gltf"),
            check=_check_mesh,
        ),
    ),
)
