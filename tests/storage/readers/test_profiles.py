"""Profiles: files written by hand against the points put into them."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from storage.readers import BadInput
from storage.readers.profiles import ProfileFile, read_profile
from storage.readers.profiles.reading import MOST_POINTS

GROOVE = [(-3.0, 0.0), (-1.5, 0.25), (0.0, -1.75), (3.0, 0.0)]


def file_of(tmp_path: Path, content: str | bytes) -> ProfileFile:
    file = tmp_path / "scratch.csv"
    file.write_bytes(content if isinstance(content, bytes) else content.encode())
    return read_profile(file)


def profile_of(tmp_path: Path, content: str | bytes) -> np.ndarray:
    return file_of(tmp_path, content).points


def lines_of(separator: str = ",", end: str = "\n", decimal: str = ".") -> str:
    rows = (f"{v!r}\t{n!r}".replace(".", decimal).replace("\t", separator) for v, n in GROOVE)
    return "".join(row + end for row in rows)


def swapped(separator: str) -> str:
    return "".join(f"{n}{separator}{v}\n" for v, n in GROOVE)


@pytest.mark.parametrize(
    "content",
    [
        lines_of(),
        lines_of(", "),
        lines_of(";"),
        lines_of(";", decimal=","),
        lines_of("\t"),
        lines_of("\t", decimal=","),
        lines_of(end="\r\n"),
        lines_of(end="\r"),
        lines_of().rstrip("\n"),
        "\ufeff" + lines_of(),
        "\ufeffv,n\r\n" + lines_of(end="\r\n"),
        "\n  \n" + lines_of(end="\n\n") + "\n",
        "# of a knife; blunt, old\n" + lines_of().replace("0.0,", "# the bottom\n0.0,"),
        "  # v of n\n" + lines_of(),
        "\ufeff# measured\nv;n\n" + lines_of(";", decimal=","),
        "-3,0\n-1.5,+.25\n0,-175e-2\n3.,0\n",
        "-3;0\n-1,5;,25\n0;-17,5E-1\n3,;0\n",
        '"v","n"\n"-3","0"\n"-1.5","0.25"\n"0","-1.75"\n"3","0"\n',
        '"-3,0";"0"\n"-1,5";"0,25"\n"0";"-1,75"\n"3";"0"\n',
    ],
)
def test_separators_line_ends_and_comments(tmp_path: Path, content: str) -> None:
    points = profile_of(tmp_path, content)
    assert points.dtype == np.float64
    np.testing.assert_array_equal(points, GROOVE)


@pytest.mark.parametrize(
    "names",
    [
        ("v", "n"),
        ("V", "N"),
        (" v ", " n"),
        ("v [um]", "n [um]"),
        ("v_um", "n_um"),
        ("v (µm)", "n (µm)"),
        ("v (\u03bcm)", "n(\u00b5m)"),
        ("V [UM]", "n"),
        ("v/µm", "n / µm"),
        ("v micrometres", "n_microns"),
    ],
)
@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_headers_name_the_columns_in_either_order(
    tmp_path: Path, names: tuple[str, str], separator: str
) -> None:
    content = separator.join(names) + "\n" + lines_of(separator)
    np.testing.assert_array_equal(profile_of(tmp_path, content), GROOVE)
    content = separator.join(names[::-1]) + "\n" + swapped(separator)
    np.testing.assert_array_equal(profile_of(tmp_path, content), GROOVE)


def test_a_header_may_be_commented_out_as_by_savetxt(tmp_path: Path) -> None:
    file = tmp_path / "scratch.csv"
    np.savetxt(file, np.array(GROOVE)[:, ::-1], delimiter=",", header="n (um), v (um)")
    assert file.read_text().startswith("# n (um), v (um)\n")
    np.testing.assert_array_equal(read_profile(file).points, GROOVE)
    # A real header wins over a commented one, and a comment among the points says nothing.
    content = "# n,v\nv,n\n" + lines_of().replace("0.0,", "# n,v\n0.0,", 1)
    np.testing.assert_array_equal(profile_of(tmp_path, content), GROOVE)


def test_other_columns_are_passed_over_where_a_header_names_v_and_n(tmp_path: Path) -> None:
    content = "point;n;note;v;velocity\n" + "".join(
        f"{i};{n};{'' if i else 'nan'};{v};x,y.z\n" for i, (v, n) in enumerate(GROOVE)
    )
    read = file_of(tmp_path, content)
    np.testing.assert_array_equal(read.points, GROOVE)
    assert read.notes == ("The columns 'point', 'note', 'velocity' were not used.",)


def test_a_profile_may_cross_itself_close_and_overhang(tmp_path: Path) -> None:
    crossing = [(0.0, 0.0), (2.0, 2.0), (2.0, 0.0), (0.0, 2.0), (0.0, 0.0)]
    content = "".join(f"{v},{n}\n" for v, n in crossing)
    np.testing.assert_array_equal(profile_of(tmp_path, content), crossing)


finite = st.floats(allow_nan=False, allow_infinity=False)


@settings(deadline=None)
@given(
    points=st.lists(st.tuples(finite, finite), min_size=3, max_size=30),
    separator=st.sampled_from([",", ";", "\t", " ; ", " "]),
    decimal=st.sampled_from(".,"),
    end=st.sampled_from(["\n", "\r\n", "\r", "\n\n", "\n# a remark, of v; and n\n"]),
    header=st.sampled_from([None, "vn", "nv", "xnyv"]),
    encoding=st.sampled_from(["utf-8", "utf-8-sig", "utf-16", "cp1252"]),
)
def test_what_is_written_is_read(
    tmp_path_factory: pytest.TempPathFactory,
    points: list[tuple[float, float]],
    separator: str,
    decimal: str,
    end: str,
    header: str | None,
    encoding: str,
) -> None:
    decimal = "." if separator == "," else decimal
    names = {"v": "v", "n": "n", "x": "tip", "y": "speed"}
    rows = [separator.join(names[name] for name in header)] if header else []
    for v, n in points:
        cells = {"v": repr(v), "n": repr(n), "x": "left", "y": "1.0"}
        rows.append(separator.join(cells[name].replace(".", decimal) for name in header or "vn"))
    text = "".join(row + end for row in rows)
    file = tmp_path_factory.getbasetemp() / "written.csv"
    file.write_bytes(text.encode(encoding))
    kept = [point for at, point in enumerate(points) if not at or point != points[at - 1]]
    flat = len({n for _, n in points}) == 1 or len({v for v, _ in points}) == 1
    if flat or len(kept) < 3:
        with pytest.raises(BadInput):
            read_profile(file)
    else:
        read = read_profile(str(file))
        np.testing.assert_array_equal(read.points, kept)
        assert len(read.notes) == (len(kept) < len(points)) + (header == "xnyv")


# --- What instruments write ---------------------------------------------------------------------

THREE = [(0.0, 0.0), (1.0, -1.5), (2.0, 0.0)]
"""Micrometres, in whatever units the files have them."""
READ: list[str | bytes] = [
    "x,z\n0,0\n1,-1.5\n2,0\n",
    "v (µm),n\n0,0\n1,-1.5\n2,0\n".encode("cp1252"),
    "v\tn\n0,0\n1,-1.5\n2,0\n",
    "v,n\n0;0\n1;-1.5\n2;0\n",
    "距離[μm],高さ[nm]\n0,0\n1,-1500\n2,0\n".encode("cp932"),
    "# x [mm]\tz [nm]\n0\t0\n.001\t-1500\n.002\t0\n",
    "0,0\n1,-1.5,\n2,0\n",
    "0 0\n1 -1.5\n2 0\n",
    "  0   0\r\n  1  -1,5\r\n  2   0\r\n\x1a",
    "Lateral,Total Profile,\num,Å,\n0,0,\n1,-15000,\n2,0,\n",
    "Lateral um,Total Profile Å\n0,0\n1,-15000\n2,0\n",
    "Scan Length,2000,um\nPoints,3\n\nX-Coord (mm);Raw (nm)\n0;0\n0,001;-1500\n0,002;0\n",
    "Profile 1\t\nx\ty\n[m]\t[m]\n0\t0\n1e-6\t-1.5e-6\n2e-6\t0\n",
    "[Profile]\nXUnit=mm\nZUnit=um\n[Data]\n0;0\n0.001;-1.5\n0.002;0\n",
    "# all lengths in nm\n0 0\n1000 -1500\n2000 0\n",
    "x in mm, z in nm\n0 0\n0.001 -1500\n0.002 0\n",
    "Position;Höhe\n[mil];[µin]\n0;0\n0.03937007874015748;-59.05511811023622\n"
    "0.07874015748031496;0\n",
    '"X Profile","Z Profile"\n"(mm)","(microns)"\n"0","0"\n"0.001","-1.5"\n"0.002","0"\n',
    "X,Z\n0,0\n1,\u22121.5\n2,0\n",
    "3\n0 0\n1 -1.5\n2 0\n",
    "sep=;\nMessstrecke [mm];Profilhöhe [nm]\n0;0\n0,001;-1500\n0,002;0\n",
    "測定距離[μm],高さデータ[μm]\n0,0\n1,-1.5\n2,0\n",
    "X,Z\n0,0.0D+00\n1,-1.5D+00\n2,0.0D+00\n",
    "X Y Z\n5 0 0\n5 1 -1.5\n5 2 0\n".replace("X Y Z", "X[um] Y[um] Z[um]"),
]


@pytest.mark.parametrize("content", READ)
def test_units_and_names_of_many_instruments(tmp_path: Path, content: str | bytes) -> None:
    np.testing.assert_allclose(profile_of(tmp_path, content), THREE, rtol=1e-12, atol=1e-15)


EVEN = "0\n-1.5\n0\n"


@pytest.mark.parametrize(
    "content",
    [
        "# step 1 um\n" + EVEN,
        "Sampling pitch;1,0;µm\n0,0\n-1,5\n0,0\n".replace(";", "\t")
        .replace("0,0", "0.0")
        .replace("-1,5", "-1.5")
        .replace("1,0\tµm", "1.0\tµm"),
        "X Resolution: 0.001 mm\nHeight [nm]\n0\n-1500\n0\n",
        "SigmaSurf_Data 1.0\nSPACING_UM: 1.00000\nNUMBER_OF_POINTS: 3\nPROFILE_UM:\n" + EVEN,
        "Profil a\r\nX-len = 2.0 X-resolution 1000.0 points/scanline: 3\r\n0\r\n-1.5\r\n0",
        "1 2\r\nSG2004 0.0e+000 PRF\r\nCX M 3.0e+000 MM 1.0e+000 D\r\n"
        "CZ M 3.0e+000 MM 1.0e-006 L\r\nEOR\r\nSTYLUS_RADIUS 0.0e+000 MM\r\n"
        "SPACING CX 1.0e-003\r\nEOR\r\n0\r\n-1500\r\n0\r\nEOR\r\nEOF\r\n",
        "ISO 5436-2:2012\0a\0\r\nPRF\0 1 ISO5436\0\r\nCX\0 I\0 3 mm\0 1.0e0 D\0 1.0e-3 \r\n"
        "CZ\0 A\0 3 um\0 1.0e0 D\0\r\n\x03\r\nDATE: 1\0\r\n\x03\r\n0\r\n-1.5\r\n0\r\n"
        "\x03\r\n123\r\n\x03\r\n\x1a",
        "aBCR - 1.0\nManufacID = a\nNumPoints = 3\nNumProfiles = 1\nXscale = 1e-6\nYscale = 0\n"
        "Zscale = 1e-9\nZresolution = -1\nCompression = 0\n*\n0 -1500 0\n*\nUserComment = b\n*\n",
    ],
)
def test_evenly_spaced_heights(tmp_path: Path, content: str) -> None:
    np.testing.assert_allclose(profile_of(tmp_path, content), THREE, rtol=1e-12, atol=1e-15)


def test_a_single_column_needs_the_setting_step(tmp_path: Path) -> None:
    file = tmp_path / "heights.txt"
    file.write_text("Höhe [µm]\n0,0\n-1,5\n0,0\n", "cp1252")
    np.testing.assert_array_equal(read_profile(file, 1.0).points, THREE)
    with pytest.raises(BadInput, match=r"heights alone; .*the setting step, in µm"):
        read_profile(file)
    file.write_text("v,n\n0,0\n1,-1.5\n2,0\n")
    read = read_profile(file, 5.0)
    np.testing.assert_array_equal(read.points, THREE)
    assert read.notes == ("The setting step was not used: the file has its own positions.",)


@pytest.mark.parametrize(
    ("content", "note"),
    [
        ("x,z\n0,0\n.5,***\n1,-1.5\n1.5,\n2,0\n", "2 points without a height were dropped."),
        ("0,0\n1,nan\n1,-1.5\n2,0\n", "1 point without a height was dropped."),
        ("0,0\n1,-1.5\n1,-1.5\n2,0\n", "1 point that repeats the one before was dropped."),
        ("v,n,v\n0,0,5\n1,-1.5,5\n2,0,5\n", "The column 'v' was not used."),
        ("v,n\n0,0\n1,-1.5\n2,0\n\nv,n\n0,0\n1,-2\n2,0\n", "another table on line 7 was not."),
        ("x,depth\n0,0\n1,1.5\n2,0\n", "The column 'depth' counts downwards and was turned over."),
        (
            "aBCR - 1.0\nNumPoints = 3\nNumProfiles = 2\nXscale = 1e-6\nZscale = 1e-6\n*\n"
            "0 -1.5 0 0 0 0\n*\n",
            "The file holds 2 profiles: the first was read.",
        ),
    ],
)
def test_what_is_mended_or_left_is_said(tmp_path: Path, content: str, note: str) -> None:
    read = file_of(tmp_path, content)
    np.testing.assert_array_equal(read.points, THREE)
    assert len(read.notes) == 1
    assert read.notes[0].endswith(note)


def test_gaps_are_where_heights_are_missing(tmp_path: Path) -> None:
    read = file_of(tmp_path, "v,n\n0,-\n1,0\n2,-1\n3,***\n4,***\n5,-1\n6,0\n7,\n")
    assert read.gaps.tolist() == [[2.0, 5.0]]
    assert len(read.points) == 4


def test_thousands_are_read_where_their_marks_are_clear(tmp_path: Path) -> None:
    content = "0;0,5\n1;-1.234,5\n2;1'000,25\n3;2 000,0\n"
    expected = [(0, 0.5), (1, -1234.5), (2, 1000.25), (3, 2000.0)]
    np.testing.assert_array_equal(profile_of(tmp_path, content), expected)


# --- What is refused ----------------------------------------------------------------------------

FEW = "number of points is"
REFUSED: list[tuple[str | bytes, str]] = [
    ("", "content is empty; expected a text file of points, a line each"),
    ("\ufeff\r\n \t\r\n", "content is empty"),
    (b"\x89PNG\r\n\x1a\n\0\0", "content is not text"),
    (b"PK\x03\x04\x14\0", "content is a zip archive (X3P, XLSX); expected a text file"),
    (b"0,0\n1,1\n\0\0\0\0\n2,0\n", "content is not text"),
    (lines_of().encode() + b"\x81", "content is not text"),
    ("# nothing yet\n", "number of points is 0; expected at least 3"),
    ("v,n\n", f"{FEW} 0"),
    ("0,0\n1,1\n", f"{FEW} 2; expected at least 3"),
    ("v,n\n0,0\n\n1,1,2\n", "number of columns on line 4 is 3; expected 2 with commas between"),
    ("0,0\n1\n2,0\n", "number of columns on line 2 is 1"),
    ("0 0\n1\n2 0\n", "number of columns on line 2 is 1; expected 2 with spaces"),
    ("0;0\n1,1\n2;0\n", "number of columns on line 2 is 1; expected 2 with semicolons"),
    ("0\n1\n2\n", "positions is missing: heights alone; expected the distance of the points as"),
    ("# height in nm\n# step 5\n0\n1\n2\n", "unit of the points' distance is missing; expected"),
    ("# step 5 um\n# step 6 um\n0\n1\n2\n", "distance of points is 5 and 6; expected one: give it"),
    ("0,5,1,5\n1,5,1,5\n", "number of columns is 4 without names; expected a header that names"),
    ("\t0\t1\n1\t1\t2\n", "number of columns is 3 without names"),
    (("1;" * 300 + "\n") * 9, "number of cells is 2709 in 9 lines; expected at most 200 in a line"),
    ("# of a knife\n0,0\r\n1,one\r\n2,0\r\n", "line 3 is '1,one'; expected numbers, as on the"),
    ("0,0\n1,1\n2,0\n3,one\n", "line 4 is '3,one'; expected numbers"),
    ("0,0\n1,1\n2,0\n3;0\n", "line 4 is '3;0'; expected numbers"),
    ("0,0\n1,\n2,0\n", f"{FEW} 2, 1 more without a height; expected at least 3"),
    ("0,0\n1_0,1\n2,0\n", "line 2 is '1_0,1'; expected numbers"),
    ("0,0\n0x1,1\n2,0\n", "line 2 is '0x1,1'"),
    ("0,0\n1,1 # the top\n2,0\n", "line 2 is '1,1 # the top'"),
    ("0,0\nv,n\n1,1\n", f"{FEW} 1"),
    ("v,n\nv,n\n1,1\n", f"{FEW} 1"),
    ("0,a\n1,1\n2,0\n", "line 1 is '0,a'"),
    ("v,n\n0,0\n1,1\n2,0\nerror\n3,1\n4,0\n", "line before 6 is no point; expected points until"),
    ("0;0,5\n1;1.234.5\n2;0\n", "line 2 is '1;1.234.5'; expected numbers"),
    ("0;0,5\n1.5;1\n", "v on line 2 is '1.5'; expected a number with a ',' before its decimals"),
    ("0;0.5\n1,5;1\n", "v on line 2 is '1,5'; expected a number with a '.' before its decimals"),
    ("0.5;1,5\n", "n on line 1 is '1,5'; expected a number with a '.'"),
    ("nan,nan\n1,0\n2,0\n", f"{FEW} 2"),
    ("0,0\n-inf,1\n2,0\n", "line 2 is '-inf,1'; expected numbers"),
    ("0,0\n1e999,1\n2,0\n", "line 2 is '1e999,1'; expected numbers"),
    ("x,v,n\n0,1,1e999\n1,2,3\n2,3,4\n", "n on line 2 is '1e999'; expected a finite number"),
    ("0,0\n# and\n0.0,-0.0\n2,1\n", f"{FEW} 2; expected at least 3 that differ"),
    ("0,2.5\n1,2.5\n2,2.5\n", "height is 2.5 µm at every point; expected a profile with relief"),
    ("1,0\n1,2\n1,3\n", "position is 1 µm at every point; expected points beside each other"),
    (
        "a,b\n0,0\n1,1\n2,0\n",
        "header on line 1 is 'a,b'; expected one column v (or x, distance, la",
    ),
    ("no profile at all\n", f"{FEW} 0"),
    ("v [mm],n\n" + lines_of(), "unit of n is missing; expected one in the header, such as n [mm]"),
    ("v,n_nm\n" + lines_of(), "unit of v is missing; expected one in the header, such as v [nm]"),
    ("x [px],z [um]\n" + lines_of(), "unit of x [px] is 'px'; expected a unit of length"),
    ("x [um],z [V]\n" + lines_of(), "unit of z [V] is 'V'; expected a unit of length"),
    ("x units: mm\nx in um\n" + lines_of(), "unit of v is mm and um; expected one: name"),
    ("X,Y,Z\n0,0,0\n1,1,1\n2,2,0\n", "columns x and y is both changing; expected one of them"),
    ("ISO 5436-2\nCX A 3 mm 1 D\n", "axis CX is not incremental; expected a profile of even"),
    ("1 2\nSG2004 0 PRF\nCX M 3 MM 1 D\n", "records is 1; expected three that end with EOR"),
    ("aBCR - 1.0\nNumPoints = 3\n", "data is missing; expected heights behind a line with an ast"),
    ("aBCR - 1.0\nNumPoints = a\n*\n1 2 3\n*\n", "field numpoints is 'a'; expected a number"),
    ("Profil\nX-len = 2\n0\n", "X-resolution on line 2 is missing; expected points a mm"),
]


def one_sentence(error: BadInput, file: str) -> str:
    text = str(error)
    assert re.fullmatch(re.escape(file) + r": .+ is .+; expected .+\.", text)
    assert ". " not in text
    return text


@pytest.mark.parametrize(("content", "reason"), REFUSED)
def test_refusals_say_why(tmp_path: Path, content: str | bytes, reason: str) -> None:
    with pytest.raises(BadInput) as caught:
        profile_of(tmp_path, content)
    assert one_sentence(caught.value, "scratch.csv").startswith(f"scratch.csv: {reason}")


def test_files_that_are_none(tmp_path: Path) -> None:
    with pytest.raises(BadInput) as caught:
        read_profile(tmp_path / "gone.csv")
    assert one_sentence(caught.value, "gone.csv").startswith("gone.csv: file is missing; expected")
    (tmp_path / "folder.csv").mkdir()
    with pytest.raises(BadInput) as caught:
        read_profile(tmp_path / "folder.csv")
    assert "file is a directory" in one_sentence(caught.value, "folder.csv")


def test_a_file_that_cannot_be_opened(tmp_path: Path) -> None:
    (tmp_path / "scratch.csv").write_text(lines_of())
    with pytest.raises(BadInput) as caught:
        read_profile(tmp_path / "scratch.csv" / "inner.csv")
    assert "file is unreadable (Not a directory)" in one_sentence(caught.value, "inner.csv")


def test_a_long_line_is_cut_short_in_the_sentence(tmp_path: Path) -> None:
    with pytest.raises(BadInput) as caught:
        profile_of(tmp_path, "0,0\n1," + "z" * 5000 + "\n")
    assert 60 < len(one_sentence(caught.value, "scratch.csv")) < 160


def test_the_most_points_and_one_more(tmp_path: Path) -> None:
    assert MOST_POINTS == 100_000
    content = "".join(f"{i},{i % 2}\n" for i in range(MOST_POINTS))
    points = profile_of(tmp_path, content)
    assert points.shape == (MOST_POINTS, 2)
    assert points[-1].tolist() == [99_999, 1]
    with pytest.raises(BadInput) as caught:
        profile_of(tmp_path, content + "100000,0\n")
    expected = (
        "number of points is 100001; expected at most 100000: export the surroundings of the "
        "scratch alone."
    )
    assert one_sentence(caught.value, "scratch.csv") == f"scratch.csv: {expected}"


def test_importing_loads_nothing_heavy() -> None:
    code = "import sys, storage.readers.profiles; print(*sys.modules)"
    modules = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    ).stdout.split()
    assert not {"cv2", "scipy", "xarray", "zarr", "pandas", "OpenEXR"} & set(modules)
