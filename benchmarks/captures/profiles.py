"""Cross-sections as profilers, microscopes and spreadsheets export them."""

from __future__ import annotations

import functools
import zipfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.captures import profile_scans
from benchmarks.captures.case import FILES, Case
from storage.readers.profiles import ProfileFile, read_profile

Floats = NDArray[np.float64]

V = np.arange(60) / 2
N = np.round(-4 * np.exp(-(((V - 11) / 3) ** 2)) + 0.6 * np.exp(-(((V - 17) / 1.5) ** 2)), 4)
"""What the files of this module hold, micrometres: a groove with one border."""
STEP = 0.5


def _table(
    head: str = "",
    cells: str = "{v:.6g},{n:.6g}",
    *,
    v: float = 1.0,
    n: float = 1.0,
    tail: str = "",
    comma: bool = False,
    encoding: str = "utf-8",
    end: str = "\n",
    missing: Sequence[int] = (),
) -> Callable[[Path], object]:
    """Writes a table; ``v``, ``n``: how many of the file's units a micrometre is."""
    lines = [
        cells.format(i=i, v=V[i] * v, n=N[i] * n).replace(".", "," if comma else ".")
        for i in range(len(V))
    ]
    for at in missing:
        lines[at] = cells.replace("{n:.6g}", "***").format(i=at, v=V[at] * v)
    text = head + "".join(line + "\n" for line in lines) + tail
    return lambda path: path.write_bytes(text.replace("\n", end).encode(encoding))


def _heights(
    head: str, tail: str = "", scale: float = 1.0, form: str = "{:.6g}", encoding: str = "utf-8"
) -> Callable[[Path], object]:
    """Writes heights alone, a line each."""
    text = head + "".join(form.format(height * scale) + "\r\n" for height in N) + tail
    return lambda path: path.write_bytes(text.encode(encoding))


def _archive(path: Path) -> None:
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("main.xml", "<ISO5436_2/>")


def _is(v: Floats = V, n: Floats = N) -> Callable[[ProfileFile], bool]:
    expected = np.stack([v, n], axis=-1)
    return lambda read: bool(
        read.points.shape == expected.shape
        and np.allclose(read.points, expected, rtol=1e-4, atol=1e-5)
    )


def _as_met(name: str, **options: Any) -> Callable[[ProfileFile], bool]:
    """The numbers of a file of the checkout, read by numpy."""
    rows = np.loadtxt(FILES / name, usecols=(0, 1), **options)
    scale = [1e3, 1e-3] if "mixed_units" in name else [1.0, 1.0]
    kept = np.concatenate([[True], (np.diff(rows, axis=0) != 0).any(axis=1)])
    return _is(*(rows[kept] * scale).T)


def _read(file: str, kind: str, write: Callable[[Path], object], **options: Any) -> Case:
    read = functools.partial(read_profile, step=options.pop("step", None))
    return Case(file, kind, read, "read", is_right=_is(**options), write=write)


def _told(file: str, kind: str, says: str, write: Callable[[Path], object], **options: Any) -> Case:
    return Case(file, kind, read_profile, "told", (says,), _is(**options), write)


def _refused(file: str, kind: str, says: str, write: Callable[[Path], object] | None) -> Case:
    return Case(file, kind, read_profile, "refused", (says,), write=write)


_COMMAS = {"delimiter": ","}
MET = (
    Case("csv_comment_mixed_units.csv", "units in a comment", read_profile, "read",
         is_right=_as_met("csv_comment_mixed_units.csv")),
    Case("csv_x_z_um.csv", "columns by other names", read_profile, "read",
         is_right=_as_met("csv_x_z_um.csv", skiprows=1, **_COMMAS)),
    Case("csv_distance_height.csv", "columns by other names", read_profile, "read",
         is_right=_as_met("csv_distance_height.csv", skiprows=1, **_COMMAS)),
    Case("csv_spaces_txt_style.csv", "spaces between columns", read_profile, "read",
         is_right=_as_met("csv_spaces_txt_style.csv")),
    Case("csv_trailing_separator.csv", "separators at lines' ends", read_profile, "read",
         is_right=_as_met("csv_trailing_separator.csv", **_COMMAS)),
    Case("csv_cp1252_micro.csv", "profiles' encodings", read_profile, "read",
         is_right=_as_met("csv_cp1252_micro.csv", skiprows=1, encoding="cp1252", **_COMMAS)),
    Case("csv_utf16_excel.csv", "profiles' encodings", read_profile, "read",
         is_right=_as_met("csv_utf16_excel.csv", skiprows=1, encoding="utf-16")),
    Case("csv_repeated_point.csv", "repeated points", read_profile, "told",
         (r"1 point .*repeats.*dropped",),
         _as_met("csv_repeated_point.csv", skiprows=1, **_COMMAS)),
    _refused("csv_single_column.csv", "heights alone", "setting step", None),
)  # fmt: skip

_DEKTAK = "Meta Data,\nScan Type,Standard Hills\nScan Length,30,um\nResolution,0.5,um/sample\n\n"
_PRF = (
    "1 2\r\nSG2004 0.000000e+000 PRF\r\nCX M 6.000000e+001 MM 1.000000e+000 D\r\n"
    "CZ M 6.000000e+001 MM 1.000000e-006 L\r\nEOR\r\nSTYLUS_RADIUS 2.000000e-003 MM\r\n"
    "SPACING CX 5.000000e-004\r\nMAP 1.000000e+000 CZ CZ 1.000000e+000 1.000000e+000\r\nEOR\r\n"
)
_SMD = (
    "ISO 5436-2:2012\0groove\0\r\nPRF\0 1 ISO5436\0\r\nCX\0 I\0 60 mm\0 1.0e0 D\0 5.0e-4 \r\n"
    "CZ\0 A\0 60 um\0 1.0e0 D\0\r\n\x03\r\nDATE: 01-May-2020\0\r\n\x03\r\n"
)
_SDF = (
    "aBCR - 1.0\r\nManufacID   = Maker\r\nCreateDate  = 010520201200\r\nNumPoints   = 60\r\n"
    "NumProfiles = {}\r\nXscale      = 5.0e-7\r\nYscale      = 0\r\nZscale      = 1.0e-9\r\n"
    "Zresolution = -1\r\nCompression = 0\r\nDataType    = 7\r\nCheckType   = 0\r\n*\r\n"
)
_SIGMA = (
    "SigmaSurf_Data 1.0\r\nIDENTIFICATION: glass 7\r\nDATE: 01 May 2020 - 12:00\r\n"
    "SPACING_UM: 0.50000\r\nNUMBER_OF_POINTS: 60\r\nPROFILE_UM:\r\n"
)
_INI = "[Profile]\nName=glass\nXUnit=mm\nZUnit=nm\nPoints=60\n[Data]\n"
_TAB = "{v:.6g}\t{n:.6g}"
_SEMI = "{v:.6g};{n:.6g}"
_QUOTED = '"{v:.6g}","{n:.6g}"'

TABLES = (
    _read("dektak_unit_row.csv", "a profiler's preamble",
          _table(_DEKTAK + "Lateral,Total Profile,\num,Å,\n", "{v:.6g},{n:.6g},", n=1e4)),
    _read("dektak_units_in_names.txt", "units in columns' names",
          _table("Lateral um\tTotal Profile Å\n", _TAB, n=1e4, encoding="cp1252")),
    _read("mountains_two_units.txt", "units in columns' names",
          _table("Profile of glass\n\nX [mm]\tZ [µm]\n", _TAB, v=1e-3, end="\r\n")),
    _read("names_slash_unit.csv", "units in columns' names",
          _table("Distance / mm;Height / nm\n", _SEMI, v=1e-3, n=1e3)),
    _read("units_with_in.csv", "units in columns' names",
          _table("x in µm,z in nm\n", n=1e3, end="\r\n")),
    _read("quoted_units_below.csv", "units under columns' names",
          _table('\ufeff"X Profile","Z Profile"\n"(mm)","(microns)"\n', _QUOTED, v=1e-3)),
    _read("origin_three_lines.txt", "units under columns' names",
          _table("Distance\tHeight\nµm\tnm\nglass\tscratch 1\n", _TAB, n=1e3)),
    _read("gwyddion_curve.txt", "profiles in metres",
          _table("Profile 1\t\nx\ty\n[m]\t[m]\n", "{v:.6g}\t{n:.6g}", v=1e-6, n=1e-6)),
    _read("fortran_exponents.dat", "profiles in metres",
          lambda path: path.write_text("x(m) z(m)\n" + "".join(
              f" {v * 1e-6:.6E} {n * 1e-6:.6E}\n".replace("E", "D")
              for v, n in zip(V, N, strict=True)))),
    _read("excel_german.csv", "decimal commas", _table(
        "Weg [µm];Höhe [nm]\n", _SEMI, n=1e3, comma=True, encoding="cp1252", end="\r\n")),
    _read("spaces_and_commas.txt", "decimal commas", _table("", "  {v:.6g}   {n:.6g}", comma=True)),
    _read("keyence_japanese.csv", "profiles' encodings", _table(
        "測定データ\n距離[μm],高さ[nm]\n", n=1e3, encoding="cp932", end="\r\n")),
    _read("french_utf16.csv", "profiles' encodings", _table(
        "\ufeffDistance (mm);Hauteur (µm)\n", _SEMI, v=1e-3, encoding="utf-16-be")),
    _read("no_mark_utf16.txt", "profiles' encodings", _table("", _TAB, encoding="utf-16-le")),
    _read("keys_of_units.txt", "units in a preamble", _table(_INI, _SEMI, v=1e-3, n=1e3)),
    _read("all_in_nm.txt", "units in a comment", _table("% all lengths in nm\n", v=1e3, n=1e3)),
    _read("savetxt_header.txt", "units in a comment", _table("# z (nm) x (µm)\n",
                                                            "{n:.6g} {v:.6g}", n=1e3)),
    _read("mil_and_microinch.csv", "inches", _table(
        "Position (mil),Elevation (µin)\n", "{v:.8g},{n:.8g}", v=1 / 25.4, n=1 / 0.0254)),
    _read("thousands_grouped.csv", "marks between thousands",
          lambda path: path.write_text("x [nm];z [nm]\n" + "".join(
              f"{v * 1e3:,.1f};{n * 1e3:,.1f}\n" for v, n in zip(V, N, strict=True)))),
    _read("minus_sign.csv", "marks between thousands",
          lambda path: path.write_text("x,z\n" + "".join(
              f"{v:.4f},{n:.4f}\n".replace("-", "\u2212") for v, n in zip(V, N, strict=True)))),
    _told("kla_raw_and_level.csv", "columns that are not used", r"'Normalized\(A\)' was not used",
          _table("X-Coord(um),Raw(A),Normalized(A)\n", "{v:.6g},{n:.6g},{i}", n=1e4)),
    _told("time_and_intensity.csv", "columns that are not used", "'No.', 'Time .*', 'Intensity'",
          _table("No.,Time (s),X (mm),Z (um),Intensity\n",
                 "{i},{i}.5,{v:.6g},{n:.6g},77", v=1e-3)),
    _told("xyz_of_a_row.txt", "columns that are not used", "'Y.*' was not used",
          _table("X[mm] Y[mm] Z[um]\n", "{v:.6g} 4.25 {n:.6g}", v=1e-3)),
    _told("two_curves.txt", "several profiles in a file", "'x2.*', 'z2.*' were not used",
          _table("x1 [um]\tz1 [um]\tx2 [um]\tz2 [um]\n", _TAB + "\t{v:.6g}\t{i}")),
    _told("two_tables.csv", "several profiles in a file", "another table on line 64 was not",
          _table("x,z\n", tail="\nx,z\n0,1\n1,2\n2,1\n")),
    _told("stars_for_missing.csv", "heights that are missing", "2 points without a height",
          _table("x,z\n", missing=(3, 50)), v=np.delete(V, [3, 50]), n=np.delete(N, [3, 50])),
    _told("depth_downwards.csv", "depths", "'Depth.*' counts downwards .*turned over",
          _table("Distance [µm],Depth [µm]\n", n=-1)),
)  # fmt: skip

EVEN = (
    _read("single_with_step.dat", "heights alone", _heights("Höhe [µm]\r\n"), step=STEP),
    _read("mitutoyo_pitch.csv", "a step in the header",
          _heights("Sampling pitch,0.5,um\r\nHeight (nm)\r\n", scale=1e3)),
    _read("lateral_resolution.asc", "a step in the header",
          _heights("# Lateral resolution: 0.0005 mm\r\n# Z unit: um\r\n")),
    _read("sigmasurf.txt", "a step in the header", _heights(_SIGMA)),
    _read("talysurf.prf", "metrology's text formats",
          _heights(_PRF, "EOR\r\nEOF\r\n", 1e3, "{:.0f}"), n=np.round(N * 1e3) / 1e3),
    _read("iso_5436_2.smd", "metrology's text formats",
          _heights(_SMD, "\x03\r\n12345\r\n\x03\r\n\x1a")),
    _read("ptb_german.txt", "metrology's text formats", _heights(
        "Profil a\r\nX-Maß = 29.5 X-Auflösung 2000.000000 Punkte/Zeile : 60\r\n",
        encoding="cp1252")),
    _read("iso_25178_71.sdf", "metrology's text formats",
          _heights(_SDF.format(1), "*\r\n", 1e3)),
    _told("several_profiles.sdf", "several profiles in a file", "2 profiles: the first was read",
          _heights(_SDF.format(2), "1\r\n" * 60 + "*\r\n", 1e3)),
)  # fmt: skip

REFUSED = (
    _refused("unit_of_one_axis.csv", "a unit that is not said", r"such as z \[mm\]",
             _table("x [mm],z\n", v=1e-3)),
    _refused("height_in_volts.csv", "units of no length", "unit of length",
             _table("x [um],z [V]\n")),
    _refused("pixels_across.csv", "units of no length", "unit of length",
             _table("X (px),Z (nm)\n")),
    _refused("two_units.txt", "units that contradict", "name the columns and their units",
             _table("# x units: mm\n# lengths of x in um\n")),
    _refused("area.csv", "measured areas", "export one profile",
             _table("", "{v:.6g},{n:.6g},{n:.6g},{n:.6g},{n:.6g}")),
    _refused("surface.x3p", "measured areas", "export as text", _archive),
    _refused("unknown_names.csv", "columns by other names", r"v \(or x, distance",
             _table("alpha,beta\n")),
    _refused("broken_line.csv", "broken lines", "as on the lines beside it",
             _table("x,z\n", tail="30,o.5\n31,0\n32,0\n")),
    _refused("mixed_decimals.csv", "marks between thousands", "before its decimals",
             _table("", _SEMI, tail="31;0,125\n")),
    _refused("diagonal.txt", "measured areas", "column of distances",
             _table("X Y Z\n", "{v:.6g} {v:.6g} {n:.6g}")),
)  # fmt: skip

CASES = MET + TABLES + EVEN + REFUSED + profile_scans.CASES
