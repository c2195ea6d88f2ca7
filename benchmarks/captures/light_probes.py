"""Light probes: environments as Radiance pictures and OpenEXR files.

The values come from the specifications: pixels encoded by hand, published matrices, the closed
form of the pictures in ``files``.
"""

from __future__ import annotations

from benchmarks.captures import exr_probe_values, exr_probes, probe_projections, radiance_probes
from benchmarks.captures.case import Case

CASES: tuple[Case, ...] = (
    *radiance_probes.CASES,
    *exr_probes.CASES,
    *exr_probe_values.CASES,
    *probe_projections.CASES,
)
