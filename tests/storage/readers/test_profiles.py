"""Profiles: files written by hand against the points put into them."""

from __future__ import annotations

import re
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from storage.readers import BadInput
from storage.readers.profiles import MOST_POINTS, read_profile

GROOVE = [(-3.0, 0.0), (-1.5, 0.25), (0.0, -1.75), (3.0, 0.0)]


def profile_of(tmp_path: Path, content: str | bytes) -> np.ndarray:
    file = tmp_path / "scratch.csv"
    file.write_bytes(content if isinstance(content, bytes) else content.encode())
    return read_profile(file)


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
    np.testing.assert_array_equal(read_profile(file), GROOVE)
    # A real header wins over a commented one, and a comment among the points says nothing.
    content = "# n,v\nv,n\n" + lines_of().replace("0.0,", "# n,v\n0.0,", 1)
    np.testing.assert_array_equal(profile_of(tmp_path, content), GROOVE)


def test_other_columns_are_passed_over_where_a_header_names_v_and_n(tmp_path: Path) -> None:
    content = "point;n;note;v;velocity\n" + "".join(
        f"{i};{n};{'' if i else 'nan'};{v};x,y.z\n" for i, (v, n) in enumerate(GROOVE)
    )
    np.testing.assert_array_equal(profile_of(tmp_path, content), GROOVE)


def test_a_profile_may_cross_itself_close_and_overhang(tmp_path: Path) -> None:
    crossing = [(0.0, 0.0), (2.0, 2.0), (2.0, 0.0), (0.0, 2.0), (0.0, 0.0)]
    content = "".join(f"{v},{n}\n" for v, n in crossing)
    np.testing.assert_array_equal(profile_of(tmp_path, content), crossing)


finite = st.floats(allow_nan=False, allow_infinity=False)


@settings(deadline=None)
@given(
    points=st.lists(st.tuples(finite, finite), min_size=3, max_size=30),
    separator=st.sampled_from([",", ";", "\t", " ; "]),
    decimal=st.sampled_from(".,"),
    end=st.sampled_from(["\n", "\r\n", "\r", "\n\n", "\n# a remark, of v; and n\n"]),
    header=st.sampled_from([None, "vn", "nv", "xnyv"]),
    mark=st.booleans(),
)
def test_what_is_written_is_read(
    tmp_path_factory: pytest.TempPathFactory,
    points: list[tuple[float, float]],
    separator: str,
    decimal: str,
    end: str,
    header: str | None,
    mark: bool,
) -> None:
    decimal = "." if separator == "," else decimal
    rows = [separator.join(header)] if header else []
    for v, n in points:
        cells = {"v": repr(v), "n": repr(n), "x": "left", "y": "1.0"}
        rows.append(separator.join(cells[name].replace(".", decimal) for name in header or "vn"))
    text = "".join(row + end for row in rows)
    file = tmp_path_factory.getbasetemp() / "written.csv"
    file.write_bytes(text.encode("utf-8-sig" if mark else "utf-8"))
    flat = len({n for _, n in points}) == 1
    if flat or any(a == b for a, b in pairwise(points)):
        with pytest.raises(BadInput):
            read_profile(file)
    else:
        np.testing.assert_array_equal(read_profile(str(file)), points)


# --- What is refused ----------------------------------------------------------------------------

REFUSED: list[tuple[str | bytes, str]] = [
    ("", "content is empty; expected a CSV file of points v, n in UTF-8"),
    ("\ufeff\r\n \t\r\n", "content is empty"),
    (b"\x89PNG\r\n\x1a\n\0\0", "content is not UTF-8 text"),
    ("v (µm),n\n0,0\n".encode("latin-1"), "content is not UTF-8 text"),
    (lines_of().encode("utf-16"), "content is not UTF-8 text"),
    (lines_of().encode("utf-16-le"), "content is not text"),
    (b"0,0\n1,1\n\0\0\0\0\n2,0\n", "content is not text"),
    (lines_of().encode() + b"\xff", "content is not UTF-8 text"),
    ("# nothing yet\n", "number of points is 0; expected at least 3"),
    ("v,n\n", "number of points is 0"),
    ("0,0\n1,1\n", "number of points is 2; expected at least 3"),
    ("v,n\n0,0\n\n1,1,2\n", "number of columns on line 4 is 3; expected 2 with commas between"),
    ("0,0\n1\n2,0\n", "number of columns on line 2 is 1"),
    ("0,0\n1,1,\n2,0\n", "number of columns on line 2 is 3"),
    ("0 0\n1 1\n2 0\n", "header on line 1 is '0 0'"),
    ("0\n1\n2\n", "number of columns on line 1 is 1"),
    ("0,5,1,5\n1,5,1,5\n", "number of columns on line 1 is 4"),
    ("x,v,n\n0,1,2\n0,1\n", "number of columns on line 3 is 2; expected 3 with commas"),
    ("v,n\n0;0\n", "number of columns on line 2 is 1; expected 2 with commas"),
    ("v\tn\n0,0\n", "number of columns on line 2 is 1; expected 2 with tabs"),
    ("0;0\n1,1\n2;0\n", "number of columns on line 2 is 1; expected 2 with semicolons"),
    ("\t0\t1\n1\t1\n", "number of columns on line 1 is 3"),
    ("# of a knife\n0,0\r\n1,one\r\n2,0\r\n", "n on line 3 is 'one'; expected a number"),
    ("0,0\n1,\n2,0\n", "n on line 2 is ''; expected a number"),
    ("0,0\n1_0,1\n2,0\n", "v on line 2 is '1_0'; expected a number"),
    ("0,0\n0x1,1\n2,0\n", "v on line 2 is '0x1'"),
    ("0,0\n1,1 # the top\n2,0\n", "n on line 2 is '1 # the top'"),
    ("0,0\nv,n\n1,1\n", "v on line 2 is 'v'"),
    ("v,n\nv,n\n1,1\n", "v on line 2 is 'v'"),
    ("0,a\n1,1\n2,0\n", "n on line 1 is 'a'"),
    ("0;0,5\n1;1.234,5\n2;0\n", "n on line 2 is '1.234,5'; expected a number"),
    ("0;0,5\n1.5;1\n", "v on line 2 is '1.5'; expected a number with a ',' before its decimals"),
    ("0;0.5\n1,5;1\n", "v on line 2 is '1,5'; expected a number with a '.' before its decimals"),
    ("0.5;1,5\n", "n on line 1 is '1,5'; expected a number with a '.'"),
    ("0,0\n1,nan\n2,0\n", "n on line 2 is 'nan'; expected a finite number"),
    ("nan,nan\n1,0\n2,0\n", "v on line 1 is 'nan'; expected a finite number"),
    ("0,0\n-inf,1\n2,0\n", "v on line 2 is '-inf'; expected a finite number"),
    ("0,0\n1e999,1\n2,0\n", "v on line 2 is '1e999'; expected a finite number"),
    (
        "0,0\n# and\n0.0,-0.0\n2,1\n",
        "line 3 is (0.0, -0.0), the same point as on line 1; expected another point",
    ),
    ("0,0\n1,1\n2,0\n2,0\n", "line 4 is (2.0, 0.0), the same point as on line 3"),
    ("0,2.5\n1,2.5\n2,2.5\n", "height n is 2.5 at every point; expected a profile with relief"),
    ("x,y\n0,0\n1,1\n2,0\n", "header on line 1 is 'x,y'; expected one column v and one column n"),
    ("# note\nv,height\n0,0\n", "header on line 2 is 'v,height'"),
    ("v,n,v\n0,0,0\n", "header on line 1 is 'v,n,v'"),
    ("v,n,N [um]\n0,0,0\n", "header on line 1 is 'v,n,N [um]'"),
    ("no profile at all\n", "header on line 1 is 'no profile at all'"),
    ("v [mm],n [um]\n" + lines_of(), "unit of v in the header is 'mm'; expected um"),
    ("v,n_nm\n" + lines_of(), "unit of n in the header is 'nm'; expected um"),
    ("# v (mm), n (mm)\n" + lines_of(), "unit of v in the header is 'mm'"),
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
    expected = "number of points is more than 100000; expected at most 100000."
    assert one_sentence(caught.value, "scratch.csv") == f"scratch.csv: {expected}"


def test_importing_loads_nothing_heavy() -> None:
    code = "import sys, storage.readers.profiles; print(*sys.modules)"
    modules = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    ).stdout.split()
    assert not {"cv2", "scipy", "xarray", "zarr", "pandas", "OpenEXR"} & set(modules)
