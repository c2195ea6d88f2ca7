"""Cases of glTF."""

from __future__ import annotations

from benchmarks.captures.case import Case
from benchmarks.captures.gltf_containers import CONTAINERS
from benchmarks.captures.gltf_geometry import GEOMETRY
from benchmarks.captures.gltf_packed import PACKED
from benchmarks.captures.gltf_scenes import SCENES

CASES: tuple[Case, ...] = CONTAINERS + GEOMETRY + PACKED + SCENES
