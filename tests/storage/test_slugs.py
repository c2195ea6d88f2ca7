"""Slugs: whatever a name holds, a key that is safe as a folder and that tells names apart."""

from __future__ import annotations

import re

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from storage.slugs import slug

_SLUG = re.compile(r"[a-z0-9_-]{1,64}")
# All of Unicode, lone surrogates too: a file's name that is not UTF-8 holds them.
_ANY_NAME = st.text(st.characters(categories=None), min_size=1, max_size=300)
_HARD_NAMES = [
    "fox/../../etc",
    "..",
    ".",
    "/",
    "fox\n",
    "\n",
    "fox|bunny",
    "Fox Fur (2).JPG",
    "x" * 300,
    "狐" * 300,
    "艶",
    "İstanbul",
    "ﬁne",
    "\udcff.jpg",
    "\ud800",
    "-",
    "--rf",
    " ",
    "\0",
    "con",
]


@given(_ANY_NAME)
@example("x" * 65)
@example("-" * 65)
def test_a_slug_is_safe(name: str) -> None:
    assert _SLUG.fullmatch(slug(name))


@given(_ANY_NAME)
def test_a_slug_of_a_slug_is_itself(name: str) -> None:
    assert slug(slug(name)) == slug(name)


@given(st.from_regex(_SLUG, fullmatch=True))
def test_a_name_that_is_a_slug_stays(name: str) -> None:
    assert slug(name) == name


@given(st.sets(_ANY_NAME, min_size=2, max_size=20))
def test_distinct_names_have_distinct_slugs(names: set[str]) -> None:
    assert len({slug(name) for name in names}) == len(names)


@pytest.mark.parametrize("name", _HARD_NAMES, ids=ascii)
def test_hard_names(name: str) -> None:
    found = slug(name)
    assert _SLUG.fullmatch(found)
    if not _SLUG.fullmatch(name):
        assert re.search(r"(^|-)[0-9a-f]{8}$", found), "expected digits of the name's hash"
        assert not found.startswith("-"), "a command would take it for an option"


def test_hard_names_stay_apart() -> None:
    # Names that look the same once what is unsafe is gone.
    alike = ["fox", "Fox", "FOX", "fox ", " fox", "fox/", "fóx", "fox\n", "狐fox", "\udcfffox"]
    assert len({slug(name) for name in alike}) == len(alike)
    assert len({slug(name) for name in _HARD_NAMES}) == len(_HARD_NAMES)


def test_a_slug_still_tells_its_name() -> None:
    assert slug("Fox Fur (2).JPG").startswith("fox-fur-2-jpg-")
    assert slug("Pelz/grün").startswith("pelz-grun-")


def test_long_names_that_start_alike_stay_apart() -> None:
    assert slug("x" * 299 + "a") != slug("x" * 299 + "b")


def test_an_empty_name_is_refused() -> None:
    with pytest.raises(ValueError, match="empty; expected"):
        slug("")
