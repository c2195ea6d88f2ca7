"""Files that are cut, altered, newer or absurd are refused in one sentence, without much memory."""

from __future__ import annotations

import contextlib
import dataclasses
import random
import re
import struct
import tracemalloc
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.bad_input_files import Case, btf_files
from benchmarks.bad_input_mutations import mutated
from storage.btf_file import (
    BtfFile,
    Quantised,
    read_btf_file,
    read_texel,
    section_bytes,
    write_btf_file,
)
from storage.btf_file.layout import sealed
from storage.readers import BadInput

FILES = btf_files()
IMAGE = FILES["image.tbtf"]


def refusal(data: bytes, read: Callable[..., object] = read_btf_file) -> BadInput:
    """The one sentence with which a file is refused."""
    with pytest.raises(BadInput) as caught:
        read(data, name="in/cloth.tbtf")
    assert re.fullmatch(r"cloth\.tbtf: .+ is .+; expected .+\.", str(caught.value))
    return caught.value


@pytest.mark.parametrize("name", FILES)
def test_a_file_that_is_cut_anywhere_is_refused(name: str) -> None:
    data = FILES[name]
    lengths = {*range(60), *range(60, len(data), 7), len(data) - 1}
    for length in sorted(lengths):
        error = refusal(data[:length])
        assert error.field in ("beginning", "length")
        refusal(data[:length], section_bytes)
    refusal(data + b"\0")


@pytest.mark.parametrize("name", FILES)
def test_any_byte_that_is_altered_is_noticed(name: str) -> None:
    data = FILES[name]
    chance = random.Random(1)
    for at in range(0, len(data), 1 if name == "image.tbtf" else 5):
        other = bytes([data[at] ^ chance.randrange(1, 256)])
        refusal(data[:at] + other + data[at + 1 :])


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", "beginning is ''; expected 'TBTF': a compressed BTF"),
        (b"PK\3\4" + bytes(99), "beginning is 'PK"),
        (IMAGE[:4] + b"\7" + IMAGE[5:], "version is 7; expected 1: have the file made again"),
        (IMAGE[:-9], "length is .* bytes; expected .*, as its header says: the whole file"),
        (IMAGE[:-9] + bytes(9), "checksum is .*; expected .*: the whole file: copy it again"),
    ],
    ids=["empty", "zip", "newer", "cut", "zeroed"],
)
def test_the_sentence_tells_what_is_wrong(data: bytes, words: str) -> None:
    assert re.search(words, str(refusal(data)))


ABSURD: dict[str, tuple[int, bytes]] = {
    "latents": (16, struct.pack("<2HI", 65535, 15259, 65535 * 15259)),
    "height": (16, struct.pack("<2HI", 0, 21, 0)),
    "lengths of streams": (16, struct.pack("<2HI", 1671, 1671, 1671**2)),
    "latent vectors": (20, struct.pack("<I", 2**32 - 1)),
    "channels": (6, b"\xff"),
    "coarser levels": (7, b"\xff"),
    "side of a tile": (36, b"\xff"),
    "layers": (37, b"\xff"),
    "layers of the student": (38, b"\xff"),
    "tables": (39, b"\xff"),
    "outputs of a layer": (40, b"\xff\xff"),
    "table of a layer": (42, b"\xfe"),
    "alpha, least, largest": (24, struct.pack("<f", np.nan)),
}


@pytest.mark.parametrize("field", ABSURD)
@pytest.mark.parametrize("read", [read_btf_file, section_bytes, "texel"])
def test_absurd_sizes_take_no_memory(field: str, read: Any) -> None:
    at, value = ABSURD[field]
    data = sealed(IMAGE[:at] + value + IMAGE[at + len(value) :])
    if read == "texel":
        read = lambda data, name: read_texel(data, 0, 0, 0, name)  # noqa: E731
    tracemalloc.start()
    try:
        error = refusal(data, read)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert error.field == field
    assert peak < 1 << 20


@given(st.sampled_from(sorted(FILES)), st.integers(0, 2**32))
@settings(max_examples=300)
def test_changes_under_a_checksum_that_belongs_to_them(name: str, seed: int) -> None:
    case = Case(name, "btf_file", name, {name: FILES[name]})
    data = mutated(case, random.Random(seed)).files[name]
    assert isinstance(data, bytes)
    for read in (read_btf_file, lambda data: read_texel(data, 0, 0, 0)):
        with contextlib.suppress(BadInput):
            read(data)


CONTENTS = read_btf_file(IMAGE)
CLUSTERS = read_btf_file(FILES["clusters.tbtf"])
LATENTS = CONTENTS.latents
assert isinstance(LATENTS, Quantised)
assert CLUSTERS.ids is not None


def decoder_with(**tensors: Any) -> dict[str, Any]:
    return {**CONTENTS.decoder, **tensors}


@pytest.mark.parametrize(
    ("btf", "words"),
    [
        (dataclasses.replace(CONTENTS, height=25), "latents is"),
        (dataclasses.replace(CONTENTS, width=0), "size is"),
        (dataclasses.replace(CONTENTS, alpha=0.0), "alpha"),
        (dataclasses.replace(CONTENTS, least=2.0), "alpha, least, largest"),
        (dataclasses.replace(CONTENTS, mips=CONTENTS.mips[1:]), "level 1 is"),
        (dataclasses.replace(CONTENTS, mips=CONTENTS.mips * 9), "coarser levels is 27"),
        (dataclasses.replace(CONTENTS, parallax=np.zeros((8, 2), np.float32)), "parallax"),
        (dataclasses.replace(CONTENTS, decoder={}), "decoder is"),
        (
            dataclasses.replace(CONTENTS, decoder=decoder_with(weight_3=np.zeros((3, 3)))),
            "decoder is",
        ),
        (
            dataclasses.replace(CONTENTS, decoder=decoder_with(bias_1=np.full(5, np.nan))),
            "bias_1 is not finite",
        ),
        (
            dataclasses.replace(CONTENTS, latents=Quantised(LATENTS.symbols + 127, LATENTS.step)),
            "latents, symbols is larger; expected -127 to 127",
        ),
        (
            dataclasses.replace(CONTENTS, latents=Quantised(LATENTS.symbols, -LATENTS.step)),
            "latents, step",
        ),
        (dataclasses.replace(CLUSTERS, ids=CLUSTERS.ids + 1), "ids is"),
    ],
)
def test_contents_that_no_file_can_hold_are_refused(btf: BtfFile, words: str) -> None:
    with pytest.raises(ValueError, match=words) as caught:
        write_btf_file(btf)
    assert re.fullmatch(r"BTF file: .+ is .+; expected .+\.", str(caught.value))


def test_levels_of_other_steps_are_refused() -> None:
    first, *rest = CONTENTS.mips
    mips = (Quantised(first.symbols, 2 * first.step), *rest)
    with pytest.raises(ValueError, match="level 2 is of other steps; expected the steps of level"):
        write_btf_file(dataclasses.replace(CONTENTS, mips=mips))
