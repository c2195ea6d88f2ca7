"""What a partition's first asset is made from: a user's file or folder, or something built in."""

from __future__ import annotations

import hashlib
import json
import os
import stat
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from storage.readers.companions import companions, travel_name
from storage.slugs import slug

NOTES = "tsuya-notes.txt"
"""Says in an inbox what lies there and is not used."""
_LITTER = ("thumbs.db", "desktop.ini", "__macosx")
_UNFINISHED = ("~", ".part", ".partial", ".crdownload", ".download", ".tmp")


@dataclass(frozen=True)
class Source:
    """A user's file or folder, or a built-in item."""

    key: str
    path: Path | None

    @classmethod
    def of(cls, path: Path) -> Source:
        """A file or a folder; its ending is part of the key: `fur.png`, `fur.jpg` are two."""
        return cls(slug(_plain_key(path)), path)

    @property
    def name(self) -> str:
        """The name that people know it by."""
        return self.key if self.path is None else self.path.name

    @property
    def fingerprint(self) -> str:
        """Hash of the file's bytes and of what it refers to, or of all files in the folder; of a
        built-in item, its key. Raises ValueError as `contents`."""
        if self.path is None:
            return f"built-in:{self.key}"
        contents = self.contents()
        if contents == [("", self.path)]:
            return _hash_of_bytes(self.path)
        return json_hash([[name, _hash_of_bytes(file)] for name, file in contents])

    def contents(self, within: Path | None = None) -> list[tuple[str, Path]]:
        """All files that belong to it, each with its place in a copy.

        In a folder: the files in it and below, links followed. Of a file: itself, named '', and
        its companions. Raises ValueError for a link that leads nowhere, in a circle or out of
        ``within``, and for what is neither file nor folder; OSError for what cannot be listed.
        """
        if self.path is None:
            return []
        if self.path.is_dir():
            files = sorted(_files_below(self.path, within, ()))
            return [(str(file.relative_to(self.path)), file) for file in files]
        beside = companions(self.path)
        for file in (self.path, *beside):
            check_link(file, within)
        named = sorted((travel_name(self.path, file), file) for file in beside)
        return [("", self.path), *named]


def check_link(path: Path, within: Path | None = None) -> None:
    """Raise ValueError for a link to nowhere, in a circle or out of the folder ``within``."""
    if not path.is_symlink():
        return
    if not path.exists():
        raise ValueError(
            f"{path.name}: is a link to {os.readlink(path)}, which leads nowhere; expected one to "
            "a file or a folder. Put the file itself in its place."
        )
    if within is not None and within.resolve() not in path.resolve().parents:
        raise ValueError(
            f"{path.name}: is a link to {os.readlink(path)}, outside of {within}; expected one to "
            "something inside. Put the file itself in its place."
        )


def _files_below(folder: Path, within: Path | None, above: tuple[Path, ...]) -> Iterator[Path]:
    """Files in a folder and below; ``above``: where the folders really are that hold this one."""
    chain = (*above, folder.resolve())
    with os.scandir(folder) as listed:
        entries = list(listed)
    for entry in entries:
        path = folder / entry.name
        if entry.is_symlink():
            check_link(path, within)
            target = path.resolve()
            if path.is_dir() and any(target in (real, *real.parents) for real in chain):
                raise ValueError(
                    f"{entry.name}: is a link to {os.readlink(path)}, a folder that it lies in "
                    f"itself ({folder.name}); expected no circle. Delete the link."
                )
        if entry.is_dir():
            yield from _files_below(path, within, chain)
        elif entry.is_file():
            yield path
        else:
            raise ValueError(f"{entry.name}: is neither a file nor a folder; expected one of them.")


def _hash_of_bytes(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def json_hash(*parts: Any) -> str:
    """SHA-256 of what JSON can hold; keys of mappings in the order of their names."""
    return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()


# ---- what lies in an inbox -------------------------------------------------------------------


@dataclass(frozen=True)
class Found:
    """What lies in a system's inbox."""

    items: dict[str, list[Path]]
    """Files, and folders of dimensions that have some, by dimension."""
    oddities: dict[str, str] = field(default_factory=dict)
    """What is no item, by its name in the inbox: a sentence that says why."""


def is_passed_over(name: str) -> bool:
    """Whether a name in an inbox is hidden, unfinished (a download's), an operating system's
    litter, or the notes' own."""
    low = name.lower()
    return low.startswith((".", "~")) or low.endswith(_UNFINISHED) or low in (NOTES, *_LITTER)


def look_into(
    inbox: Path, endings: Mapping[str, Collection[str]], folders: Collection[str]
) -> Found:
    """The items in an inbox, in the order of names; looks at names and links only.

    ``endings`` has those of each dimension's files, ``folders`` the dimensions that have folders.
    A folder that holds one file of a known ending is that file, with what it refers to around it:
    ``hall.obj/hall.obj`` and ``hall.obj/hall.mtl`` are how a scene with its materials is copied
    here. Any other folder is an item where there are such. What is odd is told, not raised; raises
    ValueError for an inbox that cannot be read.
    """
    found = Found({name: [] for name in endings})
    try:
        entries = sorted(inbox.iterdir()) if inbox.is_dir() else []
    except OSError as error:
        raise ValueError(
            f"{inbox}: cannot be read ({error.strerror}); expected a folder of yours."
        ) from error
    entries = [entry for entry in entries if not is_passed_over(entry.name)]
    flat = [e for e in entries if os.path.isfile(e) and _dimension_of(e, endings)]
    # A folder of textures beside a scene is no item, nor is its material library an oddity.
    used = _used(inbox, flat) if len(flat) < len(entries) else set()
    for entry in entries:
        if entry.name in used and entry not in flat:
            continue
        try:
            check_link(entry, inbox)
            dimension, path = _item(entry, endings, folders)
            found.items[dimension].append(path)
        except OSError as error:
            found.oddities[entry.name] = f"{entry.name}: cannot be read ({error.strerror})."
        except ValueError as error:
            found.oddities[entry.name] = str(error)
    return found


def by_key(paths: Iterable[Path]) -> dict[str, Source]:
    """Sources by their keys, all of them different.

    Of files of one name the one nearest to the inbox has the key; others get their folder's name.
    """
    sources: dict[str, Source] = {}
    for path in sorted(paths, key=lambda p: (len(p.parts), p.parent.name != p.name, p)):
        source = Source.of(path)
        if source.key in sources:
            source = Source(slug(f"{path.parent.name}/{_plain_key(path)}"), path)
        sources[source.key] = source
    return sources


def entry_of(path: Path, inbox: Path) -> Path:
    """What lies in the inbox itself: an item's file, or the folder that is or holds the item."""
    return inbox / path.relative_to(inbox).parts[0]


def _plain_key(path: Path) -> str:
    return f"{path.name}-folder" if path.is_dir() else f"{path.stem}-{path.suffix[1:]}"


def _dimension_of(path: Path, endings: Mapping[str, Collection[str]]) -> str | None:
    found = (name for name, known in endings.items() if path.suffix.lower() in known)
    return next(found, None)


def _used(inbox: Path, files: Iterable[Path]) -> set[str]:
    """What files in the inbox refer to, by its name in the inbox."""
    inside = Path(os.path.abspath(inbox))
    referred = (companion for file in files for companion in companions(file))
    return {entry_of(path, inside).name for path in referred if inside in path.parents}


def _item(
    entry: Path, endings: Mapping[str, Collection[str]], folders: Collection[str]
) -> tuple[str, Path]:
    """Dimension and path of what an entry of an inbox is. Raises ValueError where it is none."""
    known = ", ".join(ending for endings_ in endings.values() for ending in endings_)
    if not entry.is_dir():
        if not stat.S_ISREG(entry.stat().st_mode):
            raise ValueError(f"{entry.name}: is neither a file nor a folder; expected one of them.")
        dimension = _dimension_of(entry, endings)
        if dimension is None:
            what = f"ends in {entry.suffix}" if entry.suffix else "has no ending"
            expected = f"one of {known}" if known else "a folder"
            raise ValueError(f"{entry.name}: {what}; expected {expected}.")
        return dimension, entry
    inside = [
        path
        for path in sorted(entry.iterdir())
        if not is_passed_over(path.name) and os.path.isfile(path) and _dimension_of(path, endings)
    ]
    if len(inside) > 1:
        referred = {companion for path in inside for companion in companions(path)}
        own = [path for path in inside if path.name == entry.name]
        inside = own or [path for path in inside if Path(os.path.abspath(path)) not in referred]
    if len(inside) > 1:  # a profile may end in .txt, and so does the licence beside a model
        inside = [path for path in inside if path.suffix.lower() != ".txt"] or inside
    if len(inside) == 1:
        return str(_dimension_of(inside[0], endings)), inside[0]
    for dimension in folders:
        return dimension, entry
    names = ", ".join(path.name for path in inside[:3])
    holds = f"{len(inside)} files ({names} …)" if inside else "none"
    raise ValueError(
        f"{entry.name}: is a folder that holds {holds}; expected one file ({known}) with what it "
        "refers to, or the files themselves in the inbox."
    )
