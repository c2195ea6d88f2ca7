"""Cases of glTF."""

from __future__ import annotations

from benchmarks.captures.case import Case
from benchmarks.captures.gltf_containers import CONTAINERS

CASES: tuple[Case, ...] = CONTAINERS
