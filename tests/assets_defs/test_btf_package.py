"""A package holds what the file in the store holds, and the file comes out of it again."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from assets_defs.neural_btf import package as assets
from assets_defs.neural_btf.datasets import compressed_btf_dataset
from assets_defs.packages import differing_parts
from storage.btf_file import BtfFile, Quantised, write_btf_file
from storage.readers.bad_input import BadInput
from tests.btf_packages import btf_package, float_file, random_file
from tsuya.exports.packaged_btf import packaged_file

FILES = {
    "each": random_file(channels=24),
    "shared": random_file(shared=True),
    "paper": float_file(shared=True),
}


class Version:
    """As much of a stored version as the check asks for."""

    def __init__(self, file: BtfFile) -> None:
        self.dataset = compressed_btf_dataset(file)

    def input(self, asset: str) -> Any:
        """The dataset that a package is made of."""
        assert asset == "compressed_btf"
        return self.dataset


def expected(file: BtfFile) -> dict[str, Any]:
    """What the check expects of a file's package."""
    return assets._expected(Version(file))  # type: ignore[arg-type]


@pytest.mark.parametrize("name", FILES)
def test_the_file_comes_out_of_its_package_byte_by_byte(name: str) -> None:
    file = FILES[name]
    package = btf_package(file)
    assert differing_parts(package, expected(file)) == []
    assert write_btf_file(packaged_file(package)) == write_btf_file(file)


def test_a_package_of_another_schema_is_refused() -> None:
    package = btf_package(FILES["each"])
    package.meta["schema"] = 1
    with pytest.raises(BadInput, match=r"^felt\.tsuya: schema is 1; expected 2, as this Tsuya"):
        packaged_file(package)


def _next_texels(file: BtfFile) -> BtfFile:
    assert isinstance(file.latents, Quantised)
    return replace(file, latents=replace(file.latents, symbols=np.roll(file.latents.symbols, 1, 0)))


def _other_steps(file: BtfFile) -> BtfFile:
    assert isinstance(file.latents, Quantised)
    return replace(file, latents=replace(file.latents, step=file.latents.step[::-1].copy()))


def _twice_the_step(file: BtfFile) -> BtfFile:
    weights = file.decoder["weight_3"]
    assert isinstance(weights, Quantised)
    return replace(
        file, decoder={**file.decoder, "weight_3": replace(weights, step=2 * weights.step)}
    )


CHANGES: dict[str, tuple[Callable[[BtfFile], BtfFile], list[str]]] = {
    "texels": (_next_texels, ["latents"]),
    "steps": (_other_steps, ["latent_steps"]),
    "levels": (lambda file: replace(file, mips=file.mips[:1]), ["mips"]),
    "parallax": (lambda file: replace(file, parallax=np.ones((9, 2), np.float32)), ["parallax"]),
    "steps of weights": (_twice_the_step, ["steps"]),
    "student": (
        lambda file: replace(file, student=random_file(seed=5, channels=24).student),
        [f"student_{kind}_{layer}" for kind in ("bias", "weight") for layer in range(1, 5)],
    ),
}


@pytest.mark.parametrize("what", CHANGES)
def test_the_check_finds_a_package_of_other_numbers(what: str) -> None:
    change, parts = CHANGES[what]
    file = FILES["each"]
    assert differing_parts(btf_package(change(file)), expected(file)) == sorted(parts)
