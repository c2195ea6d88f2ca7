"""The suite of packages, our own reader against it, and readers that must not pass."""

from __future__ import annotations

import json
import tracemalloc
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from storage.packages import conformance
from storage.packages.digests import digests
from storage.packages.reading import Package, read_package
from storage.readers.bad_input import BadInput

GOOD, BAD = conformance.good_packages(), conformance.bad_packages()


@pytest.mark.parametrize("name", GOOD)
def test_good_packages_are_read(name: str, tmp_path: Path) -> None:
    path = tmp_path / name
    path.write_bytes(GOOD[name])
    expected = conformance.expected_digests(name)
    found = digests(str(path))
    assert found == expected


@pytest.mark.parametrize("name", BAD)
def test_bad_packages_are_refused_in_a_sentence_and_little_memory(name: str) -> None:
    tracemalloc.start()
    with pytest.raises(BadInput) as refused:
        _values(read_package(BAD[name], name))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert str(refused.value).startswith(f"{name}: ")
    assert peak < 4 << 20


def test_a_flipped_bit_is_never_believed() -> None:
    plain = GOOD["plain.tsuya"]
    truth = _values(read_package(plain))
    random = np.random.default_rng(3)
    refused = 0
    for place in random.integers(0, 8 * len(plain), 300):
        flipped = bytearray(plain)
        flipped[place // 8] ^= 1 << (place % 8)
        try:
            found = _values(read_package(bytes(flipped)))
        except BadInput:
            refused += 1
        else:  # a date, a flag, a meaning: nothing that is read
            assert found.keys() == truth.keys()
            assert all(np.array_equal(found[name], truth[name]) for name in truth)
    assert refused > 200


def _values(package: Package) -> dict[str, Any]:
    values = {}
    for name in package.parts:
        value = package.value(name)
        if hasattr(value, "vertices"):
            values |= {f"{name}/{key}": each for key, each in value.attributes.items()}
            values |= {f"{name}/vertices": value.vertices, f"{name}/triangles": value.triangles}
        else:
            values[name] = value
    return values


def test_a_reader_that_believes_everything_does_not_conform() -> None:
    found = conformance.problems(["true"])
    wrong = {line.partition(":")[0] for line in found}
    assert wrong == set(GOOD) | set(BAD)


def test_a_reader_that_refuses_everything_does_not_conform() -> None:
    found = conformance.problems(["false"])
    assert {line.partition(":")[0] for line in found} == set(GOOD)


def test_packages_are_written_for_those_who_test_elsewhere(tmp_path: Path) -> None:
    assert conformance.main(["write", str(tmp_path)]) == 0
    assert {path.name for path in (tmp_path / "good").iterdir()} == set(GOOD)
    assert {path.name for path in (tmp_path / "bad").iterdir()} == set(BAD)
    expected = json.loads((tmp_path / "expected.json").read_text())
    assert expected["plain.tsuya"]["mesh/POSITION"]


def test_the_command_says_how_it_is_called() -> None:
    assert conformance.main([]) == 2
