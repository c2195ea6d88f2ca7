"""Material databases: names, files beside the photographs, containers; then pixels and ``.btf``."""

from __future__ import annotations

import struct
import zipfile
from pathlib import Path

from benchmarks.captures import database_exr, database_factors, database_pixels
from benchmarks.captures.case import Case
from benchmarks.captures.database_files import (
    LIGHTS,
    PAIRS,
    VIEWS,
    Direction,
    case,
    codes,
    files,
    is_light,
    jpeg,
    light_of,
    plain,
    png,
    slow_codes,
    ubo2003,
    unpacked,
    utia,
    zip_bytes,
    zipped,
)

_PNG = [png(image) for image in codes()]
_RIGHT = is_light(light_of(codes()))


def _named(pattern: str) -> dict[str, bytes]:
    """Photographs whose names are a pattern of tl, pl, tv, pv."""

    def name(light: Direction, view: Direction) -> str:
        return pattern.format(tl=light[0], pl=light[1], tv=view[0], pv=view[1])

    return files(_PNG, "", name)


_PATTERNS = (
    ("utia.zip", "of UTIA", "tv{tv:03}_pv{pv:03}/tl{tl:03}_pl{pl:03}_tv{tv:03}_pv{pv:03}.png"),
    ("view_first.zip", "with the view first", "img_tv{tv}_pv{pv}_tl{tl}_pl{pl}.png"),
    ("view_folder.zip", "with the view outside", "tv{tv:03}_pv{pv:03}/tl{tl:03}_pl{pl:03}.png"),
    ("folder_a_pair.zip", "of folders", "tl{tl}_pl{pl}_tv{tv}_pv{pv}/image.png"),
    ("upper_case.zip", "in upper case", "TL{tl:03}-PL{pl:03}-TV{tv:03}-PV{pv:03}.PNG"),
    ("hyphens.zip", "with hyphens", "tl-{tl}_pl-{pl}_tv-{tv}_pv-{pv}.png"),
    ("equals.zip", "with equals signs", "tl={tl} pl={pl} tv={tv} pv={pv}.png"),
    ("decimals.zip", "with decimals", "tl{tl:.2f}_pl{pl:.2f}_tv{tv:.2f}_pv{pv:.2f}.png"),
    ("no_separator.zip", "without separators", "wood_tl{tl}pl{pl}tv{tv}pv{pv}.png"),
    ("spelled_out.zip", "spelled out", "theta_i={tl} phi_i={pl} theta_o={tv} phi_o={pv}.png"),
    ("in_and_out.zip", "in and out", "ti{tl:05.1f}_pi{pl:05.1f}_to{tv:05.1f}_po{pv:05.1f}.png"),
    ("more_digits.zip", "with more digits", "01_tl{tl:05}_pl{pl:05}_tv{tv:05}_pv{pv:05}_a.png"),
)
_NAMES = (
    *(
        case(file, f"names {kind}", zipped(_named(pattern)), _RIGHT)
        for file, kind, pattern in _PATTERNS
    ),
    case(
        "ubo2003.zip",
        "names of UBO2003",
        zipped(files([jpeg(image) for image in slow_codes()], ".jpg", ubo2003)),
        is_light(light_of(slow_codes()), 0.04),
    ),
    case(
        "decimal_commas.zip",
        "names with decimals",
        zipped(
            files(
                _PNG[:2],
                ".png",
                lambda light, view: f"tl{light[0]}_pl{light[1]}_tv0_pv0".replace(".", ","),
                [((7.5, 0.0), (0, 0)), ((7.5, 187.5), (0, 0))],
            )
        ),
        is_light(
            light_of(codes()[:2]), pairs=[((7.5, 0.0), (0, 0)), ((7.5, 187.5), (0, 0))]
        ),
    ),
    case(
        "negative_azimuths.zip",
        "angles beyond a turn",
        zipped(
            {
                f"tl{light[0]}_pl{light[1] - 360}_tv{view[0]}_pv{view[1] + 360}.png": data
                for (light, view), data in zip(PAIRS, _PNG, strict=True)
            }
        ),
        _RIGHT,
    ),
    case(
        "negative_thetas.zip",
        "angles beyond the zenith",
        zipped({"tl-30_pl10_tv0_pv0.png": _PNG[1], "tl30_pl10_tv0_pv0.png": _PNG[0]}),
        is_light(light_of(codes()[:2]), pairs=[((30, 10), (0, 0)), ((30, 190), (0, 0))]),
    ),
    case(
        "below_the_surface.zip",
        "angles below the surface",
        zipped(plain() | {"tl120_pl000_tv000_pv000.png": _PNG[0]}),
        says=[r"tl is 120 degrees", r"0 to 90 degrees: move what is below"],
    ),
    case(
        "no_names.zip",
        "names without angles",
        zipped({f"IMG_{k:04}.png": data for k, data in enumerate(_PNG)}),
        says=[r"without photographs", r"files named tl000 pl000 tv000 pv000\.jpg"],
    ),
)  # fmt: skip

_THIRD = utia(*PAIRS[2]) + ".png"
_BESIDE = (
    case(
        "documents.zip",
        "documents beside",
        zipped(
            plain()
            | {"readme.txt": b"UTIA", "info.xml": b"<a/>", "angles.xlsx": b"PK", "LICENCE": b"CC"}
        ),
        _RIGHT,
        [r"4 files \(readme\.txt, info\.xml, angles\.xlsx and 1 more\) were left out"],
    ),
    case(
        "previews.zip",
        "pictures beside",
        zipped(
            {f"preview/{name.split('/')[1]}": data for name, data in plain().items()}
            | plain()
            | {"overview.png": _PNG[0]}
        ),
        _RIGHT,
        [r"7 files .*were left out"],
    ),
    case(
        "masks.zip",
        "pictures beside",
        zipped(plain() | {"mask.png": _PNG[0], f"{_THIRD[:-4]}_mask.png": _PNG[1]}),
        _RIGHT,
        [r"2 files \(mask\.png, tl060_pl240_tv000_pv000_mask\.png\) were left out"],
    ),
    case(
        "film.zip",
        "pictures beside",
        zipped(plain() | {"clip.mp4": b"film", "thumbnail.jpg": b"no picture at all"}),
        _RIGHT,
        [r"2 files \(clip\.mp4, thumbnail\.jpg\) were left out"],
    ),
    case(
        "litter.zip",
        "litter of systems",
        zipped(
            plain()
            | {
                ".DS_Store": b"x",
                "tv000_pv000/Thumbs.db": b"x",
                "desktop.ini": b"x",
                f"__MACOSX/tv000_pv000/._{_THIRD.split('/')[1]}": b"x",
                "@eaDir/x.png": b"x",
            }
        ),
        _RIGHT,
    ),
    case(
        "copies.zip",
        "copies",
        zipped(plain() | {"copy of the first/" + _THIRD: plain()[_THIRD]}),
        _RIGHT,
        [r"1 file .* was left out: copies"],
    ),
    case(
        "twice.zip",
        "two photographs of a pair",
        zipped(plain() | {"other/" + _THIRD: _PNG[0]}),
        says=[r"tl=60 pl=240 tv=0 pv=0 is in two files that differ", r"out of the database"],
    ),
    case(
        "missing.zip",
        "missing photographs",
        zipped({name: data for name, data in plain().items() if name != _THIRD}),
        says=[r"tl=60 pl=240 tv=0 pv=0 is missing \(1 missing", r"unpack the database again"],
    ),
    case(
        "lights_differ.zip",
        "missing photographs",
        zipped(
            files(_PNG[:4], pairs=[(LIGHTS[0], VIEWS[0]), (LIGHTS[1], VIEWS[0]),
                                   (LIGHTS[0], VIEWS[1]), (LIGHTS[2], VIEWS[1])])
        ),
        says=[r"missing \(2 missing in all\)", r"only views that have all lights"],
    ),
)  # fmt: skip


def _linked(path: Path) -> None:
    """Views that are links to folders elsewhere, and one that leads back."""
    store = path.parent / "store"
    unpacked(plain())(store)
    path.mkdir()
    for view in store.iterdir():
        (path / view.name).symlink_to(view, target_is_directory=True)
    (path / "back").symlink_to(path, target_is_directory=True)


def _zip64(path: Path) -> None:
    with zipfile.ZipFile(path, "w") as archive:
        for name, data in plain().items():
            with archive.open(name, "w", force_zip64=True) as member:
                member.write(data)


def _encrypted(path: Path) -> None:
    zipped(plain())(path)
    data = bytearray(path.read_bytes())
    at = 0
    while (at := data.find(b"PK\1\2", at)) >= 0:
        data[at + 8] |= 1  # the directory's flags
        at += 4
    path.write_bytes(data)


def _with_a_stub(path: Path) -> None:
    """As a stream is zipped: sizes behind the data, and a comment at the end."""

    class Unseekable:
        def __init__(self, path: Path) -> None:
            self.stream = path.open("wb")

        def write(self, data: bytes) -> int:
            return self.stream.write(data)

        def flush(self) -> None:
            self.stream.flush()

    out = Unseekable(path)
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:  # type: ignore[call-overload]
        archive.comment = b"Filip, Vavra"
        for name, data in plain().items():
            archive.writestr(name, data)
    out.stream.close()


_HALVES = [dict(list(plain().items())[:3]), dict(list(plain().items())[3:])]
_CONTAINERS = (
    case("folder", "folders", unpacked(plain()), _RIGHT),
    case("deep_folder", "folders", unpacked({f"a/b/c/{n}": d for n, d in plain().items()}), _RIGHT),
    case("linked_folder", "folders", _linked, _RIGHT),
    case("stored.zip", "zips", zipped(plain()), _RIGHT),
    case("zip64.zip", "zips", _zip64, _RIGHT),
    case("streamed.zip", "zips", _with_a_stub, _RIGHT),
    case(
        "backslashes.zip",
        "zips",
        zipped({n.replace("/", "\\"): d for n, d in plain().items()}),
        _RIGHT,
    ),
    case("zip_in_folder", "zips in a folder", unpacked({"wood.zip": zip_bytes(plain())}), _RIGHT),
    case(
        "zip_a_view",
        "zips in a folder",
        unpacked({f"view{k}.zip": zip_bytes(half) for k, half in enumerate(_HALVES)}),
        _RIGHT,
    ),
    case(
        "zip_in_zip.zip",
        "archives that are not read",
        zipped({"wood.zip": zip_bytes(plain())}),
        says=[r"without photographs", r"unpack wood\.zip"],
    ),
    case(
        "lzma.zip",
        "archives that are not read",
        zipped(plain(), compression=zipfile.ZIP_LZMA),
        says=[r"method 14", r"unpack it to a folder"],
    ),
    case(
        "encrypted.zip",
        "archives that are not read",
        _encrypted,
        says=[r"encrypted", r"unpack it to a folder"],
    ),
    case(
        "wood.rar",
        "archives that are not read",
        lambda path: path.write_bytes(b"Rar!\x1a\x07\x01\x00" + bytes(99)),
        says=[r"RAR archive", r"unpack it to a folder"],
    ),
    case(
        "wood.7z",
        "archives that are not read",
        lambda path: path.write_bytes(b"7z\xbc\xaf\x27\x1c" + bytes(99)),
        says=[r"7z archive", r"unpack it to a folder"],
    ),
    case(
        "wood.tar.gz",
        "archives that are not read",
        lambda path: path.write_bytes(b"\x1f\x8b\x08" + bytes(99)),
        says=[r"gzip", r"unpack it to a folder"],
    ),
    case(
        "cut_short.zip",
        "archives that are not read",
        lambda path: path.write_bytes(zip_bytes(plain())[:-40]),
        says=[r"truncated or damaged", r"complete zip"],
    ),
    case(
        "lying_size.zip",
        "archives that are not read",
        lambda path: path.write_bytes(_lying(zip_bytes(plain()))),
        says=[r"damaged inside the zip", r"complete member"],
    ),
)


def _lying(data: bytes) -> bytes:
    """A directory that gives one member another checksum."""
    at = data.rindex(b"PK\1\2") + 16
    return data[:at] + struct.pack("<I", 12345) + data[at + 4 :]


CASES: tuple[Case, ...] = (
    *_NAMES,
    *_BESIDE,
    *_CONTAINERS,
    *database_pixels.CASES,
    *database_exr.CASES,
    *database_factors.CASES,
)
