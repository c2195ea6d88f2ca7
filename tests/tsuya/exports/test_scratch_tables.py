"""Scratch tables in files, read back by other libraries than wrote them."""

from __future__ import annotations

import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from storage.packages import Contents, Mesh, Package, Source, read_package, write_package
from storage.packages.glass_scratches import PACKAGE
from tsuya.exports.scratch_tables import write_exr, write_npz

BINS, SIDE, LEANS = 16, 16, 3


def glass_values(layers: int = 3) -> dict[str, Any]:
    """Random values for the parts of a glass's package."""
    random = np.random.default_rng(5)

    def halfs(*shape: int) -> Any:
        return random.random(shape).astype(np.float16)

    def floats(*shape: int) -> Any:
        return random.random(shape).astype(np.float32)

    corners = np.arange(3, dtype=np.uint32).reshape(1, 3)
    picture = np.full((4, 4, 3), 9, np.uint8)
    return {
        "table": halfs(LEANS, 2 * BINS, 2 * BINS) * np.float16(3),
        "leans": np.linspace(0, 1, LEANS, dtype=np.float32),
        "angles": floats(layers),
        "coverage": random.integers(0, 256, (layers, SIDE, SIDE, 1), np.uint8),
        "object": Mesh(floats(3, 3), corners, floats(3, 3), attributes={"FACING": floats(3, 3)}),
        "environment_lamps": halfs(8, 16, 3).view(np.uint16),
        "lights_lamps": floats(2, 64, 3),
        "poster": picture,
        "input": picture,
    }


def glass_contents(values: dict[str, Any]) -> Contents:
    """What a package of these values is written of."""
    parameters: dict[str, Any] = dict.fromkeys(PACKAGE.parameters, 0.5)
    parameters |= {"refractive_index": 1.5, "tile": 0.7, "keeps_lean": True}
    return Contents("groove on vase", (Source("groove", "CC0"),), values, parameters)


def glass_package(values: dict[str, Any]) -> Package:
    """A package of these values."""
    return read_package(write_package(PACKAGE, glass_contents(values)))


@pytest.fixture(scope="module")
def values() -> dict[str, Any]:
    return glass_values()


@pytest.fixture(scope="module")
def package(values: dict[str, Any]) -> Package:
    return glass_package(values)


def _read_exr(path: Path) -> dict[str, Any]:
    """Channels by name, by Mitsuba."""
    mitsuba = pytest.importorskip("mitsuba")
    mitsuba.set_variant("scalar_rgb")
    bitmap = mitsuba.Bitmap(str(path))
    pixels = np.array(bitmap).reshape(bitmap.height(), bitmap.width(), -1)
    fields = [field.name for field in bitmap.struct_()]
    return {name: pixels[..., n] for n, name in enumerate(fields)}


@pytest.mark.reads_back("exr")
def test_exr_files_hold_the_tables_for_another_reader(
    package: Package, values: dict[str, Any], tmp_path: Path
) -> None:
    notes = write_exr(package, tmp_path / "tables")
    assert "8 bits" in notes[0]
    names = sorted(each.name for each in (tmp_path / "tables").iterdir())
    assert names == ["coverage.exr", "readme.txt", "scratch_table.exr"]
    (table,) = _read_exr(tmp_path / "tables" / "scratch_table.exr").values()
    assert table.shape == (LEANS * 2 * BINS, 2 * BINS)
    for n in range(LEANS):
        assert np.array_equal(table[2 * BINS * n : 2 * BINS * (n + 1)], values["table"][n])
    coverage = _read_exr(tmp_path / "tables" / "coverage.exr")
    assert len(coverage) == 3
    for n in range(3):
        expected = values["coverage"][n, ..., 0] / 255
        assert np.allclose(coverage[f"layer_{n + 1}"], expected, atol=1e-7)


def test_eight_layers_are_eight_channels(tmp_path: Path) -> None:
    values = glass_values(layers=8)
    write_exr(glass_package(values), tmp_path / "tables")
    coverage = _read_exr(tmp_path / "tables" / "coverage.exr")
    assert sorted(coverage) == [f"layer_{n + 1}" for n in range(8)]
    assert np.allclose(coverage["layer_8"], values["coverage"][7, ..., 0] / 255, atol=1e-7)


def test_the_text_beside_says_what_they_are(package: Package, tmp_path: Path) -> None:
    write_exr(package, tmp_path / "tables")
    text = (tmp_path / "tables" / "readme.txt").read_text("utf-8")
    assert text.startswith("groove on vase\n")
    assert "refractive index 1.5, roughness of the walls 0.5, side of a tile 0.7" in text
    assert f"{package.array('angles')[2]:.6f}" in text
    assert "where it is: 0.000000, 0.500000, 1.000000\n" in text
    assert "walls keep the lean: yes" in text


@pytest.mark.reads_back("npz")
def test_npz_is_as_documented(package: Package, values: dict[str, Any], tmp_path: Path) -> None:
    """Read without NumPy's own reader of archives: zip, then each header as its page says."""
    write_npz(package, tmp_path / "glass.npz")
    found = {}
    with zipfile.ZipFile(tmp_path / "glass.npz") as archive:
        for name in archive.namelist():
            found[name.removesuffix(".npy")] = _npy(archive.read(name))
    for name in ("table", "leans", "angles"):
        assert found[name].dtype == values[name].dtype
        assert np.array_equal(found[name], values[name])
    assert np.allclose(found["coverage"], values["coverage"][..., 0] / 255, atol=1e-7)
    assert found["refractive_index"] == 1.5
    assert found["keeps_lean"] == 1.0
    assert sorted(found) == [
        "angles",
        "coverage",
        "keeps_lean",
        "leans",
        "refractive_index",
        "roughness",
        "table",
        "tile",
    ]


def _npy(content: bytes) -> Any:
    import ast

    assert content[:8] == b"\x93NUMPY\x01\x00"
    length = int.from_bytes(content[8:10], "little")
    header = ast.literal_eval(content[10 : 10 + length].decode())
    assert not header["fortran_order"]
    return np.frombuffer(content[10 + length :], header["descr"]).reshape(header["shape"])
