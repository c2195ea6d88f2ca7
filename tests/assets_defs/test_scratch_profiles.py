"""Users' cross-sections with the settings of `scratch_profile`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from assets_defs.glass_scratches.profile_files import load_profile
from assets_defs.glass_scratches.tables import ProfileSettings, scratch_profile
from assets_defs.sources import Source
from assets_defs.system import NOTES
from storage.readers.profiles import columns as profile_columns

MILLIMETRES_AND_NANOMETRES = "x [mm],z [nm]\n-0.006,0\n-0.001,-3000\n0.002,-2000\n0.006,0\n"


def settings(**given: Any) -> dict[str, Any]:
    return ProfileSettings(**given).model_dump()


def source_of(tmp_path: Path, content: str) -> Source:
    file = tmp_path / "groove.csv"
    file.write_text(content)
    return Source.of(file)


def test_units_of_both_axes_are_read(tmp_path: Path) -> None:
    made = load_profile(source_of(tmp_path, MILLIMETRES_AND_NANOMETRES), settings())
    np.testing.assert_allclose(made.points, [(-6, 0), (-1, -3), (2, -2), (6, 0)], atol=1e-12)
    assert made.notes == ()


def test_a_unit_that_is_read_wrong_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Planted: every unit is a micrometre, as all were once."""
    monkeypatch.setattr(profile_columns, "micrometres", lambda unit: 1.0)
    with pytest.raises(ValueError, match=r"0\.012 µm wide and 3e\+03 µm deep; .*name the units"):
        load_profile(source_of(tmp_path, MILLIMETRES_AND_NANOMETRES), settings())


def test_heights_alone_are_read_with_the_setting_step(tmp_path: Path) -> None:
    source = source_of(tmp_path, "0\n-3\n-2\n0\n")
    with pytest.raises(ValueError, match="the setting step"):
        load_profile(source, settings())
    made = load_profile(source, settings(step=4.0))
    np.testing.assert_allclose(made.points, [(-6, 0), (-2, -3), (2, -2), (6, 0)])


def test_a_tilted_scan_is_read_with_the_setting_level(tmp_path: Path) -> None:
    v = np.linspace(0.0, 400.0, 401)
    n = -4 * np.maximum(1 - np.abs(v - 150) / 10, 0) + 0.2 * v
    source = source_of(tmp_path, "".join(f"{a},{b}\n" for a, b in zip(v, n, strict=True)))
    made = load_profile(source, settings(level=True))
    np.testing.assert_allclose(made.points[[0, 10, -1]], [(-10, 0), (0, -4), (10, 0)], atol=0.03)


def test_what_was_mended_and_left_is_in_the_metadata(tmp_path: Path) -> None:
    source = source_of(tmp_path, "x,z,grade\n-6,0,a\n-1,-3,b\n-1,-3,b\n6,0,c\n")
    dataset, metadata = scratch_profile(ProfileSettings(), source)
    assert dataset["points"].shape == (3, 2)
    assert metadata[NOTES] == (
        "The column 'grade' was not used.",
        "1 point that repeats the one before was dropped.",
    )
    _, metadata = scratch_profile(ProfileSettings(), Source("setting-1", None))
    assert metadata[NOTES] == ()
