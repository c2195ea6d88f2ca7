"""Which channels of an OpenEXR file are its picture, by the names that programs give them.

Channels are called layer.channel ("Technical Introduction to OpenEXR"); a part's name is one more
layer. The picture is what has no layer, or the one that renderers and compositors call combined,
beauty, rgba and the like; of a stereo file, the view that is named first.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from storage.readers.bad_input import BadInput, shortened

RGB, XYZ, LUMINANCE_CHROMA, GREY = "RGB", "XYZ", "luminance and chroma", "grey"

_KINDS = (
    (RGB, ("r", "g", "b")),
    (RGB, ("red", "green", "blue")),
    (LUMINANCE_CHROMA, ("y", "ry", "by")),
    (XYZ, ("x", "y", "z")),
    (GREY, ("y",)),
)
_ALPHA = ("a", "alpha")
_PICTURES = ("combined", "beauty", "rgba", "rgb")
"""However deep: ``View Layer.Combined.R``, ``left.beauty.R``."""
_PICTURES_ALONE = (
    *("c", "ci", "color", "colour", "composite", "default", "final", "finalimage", "image"),
    *("main", "output", "radiance", "render", "xyz"),
)
"""A layer's whole name: ``diffuse.color`` is another thing."""
_VIEWS = ("left", "right", "center", "centre")
_CHANNEL = re.compile(r"(?:(?P<layer>.*)\.)?(?P<last>[^.]*)")
_UNDOTTED = re.compile(r"(?P<layer>.+)[_:/ -](?P<last>r|g|b|a|red|green|blue|alpha)", re.IGNORECASE)
_SHOWN = 8
_MOST_VIEWS = 16
_NEEDED = "R, G, B or X, Y, Z or Y, RY, BY or Y alone"
_UNKNOWN = 3


class Part(NamedTuple):
    """Of a file: ``name`` "" where it is the only one; ``view`` of stereo, "" without;
    ``channels``, by their names in the file."""

    name: str
    view: str
    channels: Sequence[str]


class Layer(NamedTuple):
    """What is read: ``part`` by its place; ``channels`` in the order of the ``kind``'s colours.

    ``name`` is "" for what has none; ``notes`` say by which name a picture was found that has no
    usual one, and what is not used.
    """

    part: int
    name: str
    kind: str
    channels: tuple[str, ...]
    alpha: str | None
    notes: tuple[str, ...] = ()


def picture_of(file: Path, parts: Sequence[Part], views: Sequence[str]) -> Layer:
    """The layer that is the file's picture; ``views``, the default one first, are those that the
    header names. Raises BadInput where no layer has colours, or several without a known name."""
    grouped = [(index, _grouped(part)) for index, part in enumerate(parts)]
    layers = [
        layer
        for index, groups in grouped
        for name, channels in groups.items()
        if (layer := _layer(index, name, channels))
    ]
    if not layers:
        every = [name for part in parts for name in part.channels]
        found = _listed(sorted(every)) or "none"
        raise BadInput(file, "channels", found, f"{_NEEDED}: save the picture's colours as R, G, B")
    every_view = [view.lower() for view in (*views, *(p.view for p in parts if p.view))]
    ranks = [_rank(layer, (*every_view[:_MOST_VIEWS], *_VIEWS)) for layer in layers]
    best = min(ranks)
    unnamed = best[0] == _UNKNOWN
    if unnamed and sum(rank[:2] == best[:2] for rank in ranks) > 1:
        found = _listed([layer.name for layer in layers])
        raise BadInput(file, "layers", found, "one picture: save the beauty alone, as R, G, B")
    chosen = layers[ranks.index(best)]
    used = {*chosen.channels, chosen.alpha}
    others = [
        name or last
        for index, groups in grouped
        for name, channels in groups.items()
        for last, channel in channels.items()
        if index != chosen.part or channel not in used
    ]
    notes = [f"The picture is the layer {shortened(chosen.name)!r}."] if unnamed else []
    if others:
        notes.append(f"Layers and channels left out: {_listed(list(dict.fromkeys(others)))}.")
    return chosen._replace(notes=tuple(notes))


def _grouped(part: Part) -> dict[str, dict[str, str]]:
    """By layer, "" for none: the file's names of the channels by their last words."""
    groups: dict[str, dict[str, str]] = {}
    for channel in part.channels:
        match = _CHANNEL.fullmatch(channel)
        if "." not in channel:
            match = _UNDOTTED.fullmatch(channel) or match
        if match is None:  # a line's end in a name
            continue
        layer = match["layer"] or ""
        if not layer.startswith(part.name):  # some repeat it
            layer = f"{part.name}.{layer}".rstrip(".")
        groups.setdefault(layer, {})[match["last"]] = channel
    return groups


def _layer(part: int, name: str, channels: Mapping[str, str]) -> Layer | None:
    plain = {last.lower(): channel for last, channel in channels.items()}
    for kind, needed in _KINDS:
        if kind == XYZ and name.lower() not in ("", "xyz"):
            continue  # a direction or a place
        if kind == GREY and {"x", "z", "u", "v", "ry", "by"} & plain.keys():
            continue
        if set(needed) <= plain.keys():
            alpha = next((plain[last] for last in _ALPHA if last in plain), None)
            return Layer(part, name, kind, tuple(plain[last] for last in needed), alpha)
    return None


def _rank(layer: Layer, views: Sequence[str]) -> tuple[int, bool, int]:
    """Small for the picture; among equals, colours before grey, then by view."""
    words = [word for word in re.split(r"[./]", layer.name.lower()) if word]
    grey = layer.kind == GREY
    view = -1
    for place, one in enumerate(views):
        without = [re.sub(rf"^{re.escape(one)}[_-]|[_-]{re.escape(one)}$", "", w) for w in words]
        without = [word for word in without if word != one]
        if without != words:
            view, words = place, without
            break
    if not words:
        return 0, grey, view
    if words[0] == "composite" and words[-1] in _PICTURES:  # of all of Blender's layers
        return 1, grey, view
    if words[-1] in _PICTURES or words in [[alone] for alone in _PICTURES_ALONE]:
        return 2, grey, view
    return _UNKNOWN, grey, view


def _listed(names: Sequence[str]) -> str:
    more = f" and {len(names) - _SHOWN} more" if len(names) > _SHOWN else ""
    return ", ".join(shortened(name, 40) for name in names[:_SHOWN]) + more
