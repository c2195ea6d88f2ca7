"""The decoder written from docs/ssdf_file.md against ours, bit for bit."""

from __future__ import annotations

import base64
import json
from pathlib import Path

import numpy as np
import pytest

from assets_defs.workspace import CHECKOUT
from pipelines.ssdf_lighting.compression.compact import decoded_coordinates, shared_vectors
from pipelines.ssdf_lighting.compression.compact_file import compress, from_bytes
from pipelines.ssdf_lighting.distances.octahedral import solid_angles
from pipelines.ssdf_lighting.distances.weighted_sphere import root_weights
from tests.pipelines.ssdf_lighting.compression.test_decoder import floor_by_a_wall
from tests.reference import ssdf_page_decoder as page

LISTS = ("ranks", "shared_level", "level", "cluster", "shared", "centre", "basis", "weights")


def ours(file: bytes) -> dict[str, np.ndarray]:
    codes = from_bytes(file)
    return {name: getattr(codes, name) for name in LISTS}


def wall(clusters: int, rmse: float) -> bytes:
    matrix, triangles = floor_by_a_wall()
    return compress(matrix, triangles, clusters=clusters, rmse=rmse)


def flat() -> bytes:
    """Of one cluster without a vector."""
    matrix = np.full((6, 64), 0.5, np.float32)
    return compress(matrix, np.array([[0, 1, 2], [3, 4, 5]]), clusters=1, rmse=0.05)


def fixture() -> bytes:
    """The one that the browser's decoder is tested with."""
    stored = json.loads((CHECKOUT / "viewer" / "tests" / "ssdf_lighting.json").read_text())
    return base64.b64decode(stored["file"])


FILES = {
    "fixture": fixture,
    "wall": lambda: wall(8, 0.01),
    "fine": lambda: wall(3, 0.002),  # sizes beyond 14
    "flat": flat,
}


@pytest.mark.parametrize("name", FILES)
def test_every_number_is_the_same(name: str) -> None:
    file = FILES[name]()
    numbers = page.numbers_of(file)
    assert page.mismatches(numbers, ours(file)) == 0
    assert numbers.step == from_bytes(file).step


def test_some_file_asks_every_kind_of_question() -> None:
    numbers = page.numbers_of(FILES["fine"]())
    assert max(abs(each) for each in numbers.shared + numbers.weights) > 16


def test_an_altered_byte_or_constant_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    file = FILES["fixture"]()
    altered = bytearray(file)
    altered[len(file) // 2] ^= 16
    assert page.mismatches(page.numbers_of(bytes(altered)), ours(file)) > 100
    for name, value in (("SPEEDS", (4, 6)), ("MOST", 40000), ("octaves", lambda v, a, m: 0)):
        with monkeypatch.context() as patch:
            patch.setattr(page, name, value)
            try:
                wrong = page.mismatches(page.numbers_of(file), ours(file))
            except ValueError:
                continue
            assert wrong > 100, name


def test_the_numbers_mean_the_same_distances() -> None:
    file = FILES["wall"]()
    found = page.distances_of(page.numbers_of(file), solid_angles)
    codes = from_bytes(file)
    weighted = decoded_coordinates(codes) @ shared_vectors(codes)
    expected = weighted / root_weights(weighted.shape[1])
    np.testing.assert_allclose(found, expected, atol=1e-4)
    assert np.abs(found[1:] - expected[:-1]).max() > 0.1


def test_what_is_refused_is_refused_by_both() -> None:
    file = FILES["fixture"]()
    wrong = [
        b"TSUYASDG" + file[8:],
        file[:8] + b"\2" + file[9:],
        file[:10] + b"\3" + file[11:],
        file[:24] + bytes(4) + file[28:],
        file[:36] + b"\xff" + file[37:],
        file[: len(file) // 2],
    ]
    for data in wrong:
        for read in (page.numbers_of, from_bytes):
            with pytest.raises(ValueError, match=r"."):
                read(data)


def test_the_page_names_the_constants_that_both_have() -> None:
    text = Path(CHECKOUT / "docs" / "ssdf_file.md").read_text()
    for number in ("12 000", "4000", "0 … 80", "32 … 65504", "2^24", "s = 4", "s = 7"):
        assert number in text, number
