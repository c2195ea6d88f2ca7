"""A user's photographs of a virtual cloth, however they lie in their files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from assets_defs.neural_btf.measured import measured_photographs
from benchmarks.captures.orientations import Photographed, laid, photographed
from tests.storage.readers.btf_writers import hdr_bytes, rgbe_of, ubo_name, write_folder


@pytest.fixture(scope="module")
def cloth() -> Photographed:
    return photographed("corduroy", texels=32)


def written(path: Path, cloth: Photographed, photographs: NDArray[np.float32]) -> Path:
    """As ATRIUM HDR, columns first."""
    files = {}
    degrees = np.round(np.degrees(np.stack([*cloth.pairs], axis=1))).astype(int).tolist()
    for (light, view), image in zip(degrees, photographs, strict=True):
        files[ubo_name(light, view, suffix="hdr")] = hdr_bytes(
            rgbe_of(image.astype(np.float64)), "+X -Y", runs=False
        )
    return write_folder(path, files)


def test_photographs_are_turned_upright_and_it_is_said(tmp_path: Path, cloth: Photographed) -> None:
    turned = laid(cloth.photographs[:, 2:], "turned 90")  # 30 rows, 32 columns upright
    path = written(tmp_path / "ceiling", cloth, turned)
    found = measured_photographs(path, None, "auto", "auto")
    assert (found.height, found.width) == (30, 32)
    assert found.about["orientation"] == "turned 90"
    (note,) = found.notes
    assert "lie turned 90 in their files" in note
    assert "set orientation to upright" in note
    np.testing.assert_allclose(found.read(41, 43), cloth.photographs[41:43, 2:], atol=0.02)
    # A crop is of the files' photographs; how they lie is still what all of them show.
    cropped = measured_photographs(path, (1, 4, 10, 6), "auto", "auto")
    assert (cropped.height, cropped.width) == (10, 6)
    np.testing.assert_array_equal(
        cropped.read(41, 42), found.read(41, 42)[:, 1:11, 32 - 10 : 32 - 4]
    )


def test_what_is_said_of_the_orientation_is_done(tmp_path: Path, cloth: Photographed) -> None:
    path = written(tmp_path / "ceiling", cloth, cloth.photographs)
    upright = measured_photographs(path, None, "auto", "auto")
    assert upright.notes == ()
    mirrored = measured_photographs(path, None, "auto", "mirrored")
    assert mirrored.notes == ()
    np.testing.assert_array_equal(mirrored.read(5, 7), upright.read(5, 7)[:, :, ::-1])


def test_flat_photographs_stay_as_they_lie_and_it_is_said(
    tmp_path: Path, cloth: Photographed
) -> None:
    print_ = np.random.default_rng(0).random((32, 32, 3)).astype(np.float32)
    cosine = np.cos(cloth.pairs.light[:, 0]).astype(np.float32)
    path = written(tmp_path / "print", cloth, cosine[:, None, None, None] * print_)
    found = measured_photographs(path, None, "auto", "auto")
    assert found.about["orientation"] == "upright"
    (note,) = found.notes
    assert "too little relief" in note
    assert "set orientation" in note
