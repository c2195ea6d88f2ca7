"""What the package assets of all systems have in common: settings, dataset, the check."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from pydantic import Field

from assets_defs.checks import Check
from assets_defs.settings import Settings
from storage.stored_version import StoredVersion

if TYPE_CHECKING:
    import xarray as xr

    from storage.packages import Package

Expected = Callable[[StoredVersion], Mapping[str, Any]]
"""Values of parts, by name, taken straight from the datasets that a package was made from."""


class PackageSettings(Settings):
    """What whoever gets the package should know."""

    licence: str = Field(
        "",
        max_length=200,
        description="Licence of your measurement, as the package states it: CC-BY-4.0, …",
    )


def package_dataset(content: bytes) -> xr.Dataset:
    """A package's bytes as a dataset."""
    import numpy as np
    import xarray as xr

    return xr.Dataset({"file": (("byte",), np.frombuffer(content, np.uint8).copy())})


def package_of(version: StoredVersion) -> Package:
    """The package of a version, opened. Raises BadInput where it cannot be read."""
    from storage.packages import read_package

    name = f"{version.slot.partition}.tsuya"
    return read_package(version.dataset["file"].values.tobytes(), name)


def read_back_check(expected: Expected) -> Check:
    """The blocking check of a package: it says what its inputs say, to an independent reader."""

    def mismatches(version: StoredVersion) -> float:
        return float(len(differing_parts(package_of(version), expected(version))))

    return Check(
        "mismatches",
        "Parts that the independent reader cannot read, or finds other values in than the inputs "
        "have.",
        mismatches,
        at_most=0.0,
    )


def differing_parts(package: Package, expected: Mapping[str, Any]) -> list[str]:
    """Names of parts that cannot be read or do not hold the expected values.

    Of values that are not expected only that they can be read is asked. Raises ValueError where
    nothing is expected: such a check could not fail.
    """
    if not expected:
        raise ValueError(f"{package.name}: no values are expected; expected some to compare.")
    differing = []
    for name in {*package.parts, *expected}:
        try:
            found = package.value(name)
        except ValueError:  # BadInput is one
            differing.append(name)
            continue
        if name in expected and not _agree(found, expected[name]):
            differing.append(name)
    return sorted(differing)


def _agree(found: Any, expected: Any) -> bool:
    import numpy as np

    from storage.packages import Mesh

    if isinstance(found, Mesh):
        # v is stored as 1 - v, which costs half a unit in the last place.
        uvs_agree = (found.uvs is None) == (expected.uvs is None) and (
            found.uvs is None or np.allclose(found.uvs, expected.uvs, rtol=0, atol=1e-6)
        )
        pairs = [
            (found.vertices, expected.vertices),
            (found.triangles, expected.triangles),
            (found.normals, expected.normals),
            *((values, expected.attributes[key]) for key, values in found.attributes.items()),
        ]
        return uvs_agree and all(_equal(one, other) for one, other in pairs)
    return found.dtype == np.asarray(expected).dtype and _equal(found, expected)


def _equal(found: Any, expected: Any) -> bool:
    import numpy as np

    if found is None or expected is None:
        return found is expected
    return bool(np.array_equal(found, expected))
