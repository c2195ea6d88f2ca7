"""What the package assets of all systems share."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from assets_defs.packages import differing_parts
from storage.packages import read_package, write_package
from storage.packages.conformance import SMALL, small_contents

PACKAGE = read_package(write_package(SMALL, small_contents()))


def test_what_was_written_does_not_differ() -> None:
    assert differing_parts(PACKAGE, small_contents().values) == []


@pytest.mark.parametrize("name", ["float32", "picture_3", "halfs"])
def test_one_other_value_is_found(name: str) -> None:
    changed: Any = small_contents().values[name].copy()
    changed.reshape(-1)[3] += 1
    assert differing_parts(PACKAGE, {name: changed}) == [name]


def test_another_type_of_the_same_values_is_found() -> None:
    values = small_contents().values["float16"].astype(np.float32)
    assert differing_parts(PACKAGE, {"float16": values}) == ["float16"]


def test_another_mesh_is_found() -> None:
    mesh = small_contents().values["mesh"]
    for field in ("vertices", "triangles", "normals", "uvs"):
        other = replace(mesh, **{field: getattr(mesh, field)[::-1]})
        assert differing_parts(PACKAGE, {"mesh": other}) == ["mesh"]
    other = replace(mesh, attributes={"LAYER": mesh.attributes["LAYER"][::-1]})
    assert differing_parts(PACKAGE, {"mesh": other}) == ["mesh"]


def test_a_part_that_is_not_there_is_found() -> None:
    assert differing_parts(PACKAGE, {"latents": np.zeros(3)}) == ["latents"]


def test_a_check_that_compares_nothing_is_refused() -> None:
    with pytest.raises(ValueError, match="no values are expected"):
        differing_parts(PACKAGE, {})
