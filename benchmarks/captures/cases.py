"""All cases, by the kind of file: each kind has a module of that name."""

from __future__ import annotations

from benchmarks.captures import (
    databases,
    gltf,
    light_probes,
    materials,
    meshes,
    photographs,
    profiles,
)
from benchmarks.captures.case import Case

CASES: dict[str, tuple[Case, ...]] = {
    "databases": databases.CASES,
    "gltf": gltf.CASES,
    "light_probes": light_probes.CASES,
    "materials": materials.CASES,
    "meshes": meshes.CASES,
    "photographs": photographs.CASES,
    "profiles": profiles.CASES,
}
