"""Where the files of a BTF database lie: in a zip or in a folder.

Zip members are read by their place in the file, not through one open ``ZipFile``: that needs no
shared handle, so that any thread and any pickled copy can read, and it costs less than parsing a
directory of 6561 members for every block.
"""

from __future__ import annotations

import os
import struct
import zipfile
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple, Protocol

from storage.readers.bad_input import BadInput
from storage.readers.btf_names import photograph_name
from storage.readers.opening import check_file, first_bytes

LARGEST_MEMBER = 64_000_000
"""Bytes of one photograph's file; a member that unpacks to more is no photograph."""

_PHOTOGRAPH = "a BTF photograph"
_LOCAL_HEADER = struct.Struct("<4s22xHH")  # signature, lengths of the name and of the extra field
_STORED, _DEFLATED = zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED


class Members(Protocol):
    """The files of one database. All methods raise BadInput for what cannot be read."""

    @property
    def path(self) -> Path:
        """The zip or the folder."""
        ...

    def names(self) -> list[str]:
        """Paths inside, with forward slashes; directories left out."""
        ...

    def size(self, name: str) -> int:
        """Bytes of a file, unpacked."""
        ...

    def start(self, name: str, count: int) -> bytes:
        """About the first ``count`` bytes of a file; all of them if there are no more."""
        ...

    def whole(self, name: str) -> bytes:
        """A file's content, its checksum verified where there is one."""
        ...


class _ZipMember(NamedTuple):
    offset: int
    packed: int
    size: int
    checksum: int
    method: int
    encrypted: bool


@dataclass(frozen=True)
class ZipMembers:
    """The members of a zip (APPNOTE 6.3), stored or deflated."""

    path: Path
    listed: list[str]
    members: dict[str, _ZipMember]

    def names(self) -> list[str]:
        """Paths inside, in the order of the zip's directory; twice what is there twice."""
        return self.listed

    def size(self, name: str) -> int:
        """Bytes of a member, unpacked, as the zip's directory says."""
        return self.members[name].size

    def start(self, name: str, count: int) -> bytes:
        """What the first ``count`` packed bytes hold, at most ``count`` bytes."""
        member = self._checked(name)
        packed = self._packed(name, member, min(member.packed, count + 64))
        return self._unpacked(name, member, packed, min(member.size, count))

    def whole(self, name: str) -> bytes:
        """A member's content. Raises BadInput where length or checksum are not the directory's."""
        member = self._checked(name)
        # One byte more than expected is enough to notice a member that unpacks to more.
        data = self._unpacked(
            name, member, self._packed(name, member, member.packed), member.size + 1
        )
        if len(data) != member.size or zlib.crc32(data) != member.checksum:
            raise self._damaged(name)
        return data

    def _checked(self, name: str) -> _ZipMember:
        member = self.members[name]
        if member.encrypted:
            expected = "a zip without a password: unpack it to a folder"
            raise BadInput(self.path / name, "content", "encrypted", expected)
        if member.method not in (_STORED, _DEFLATED):
            raise BadInput(
                self.path / name,
                "zip compression",
                f"method {member.method}",
                f"stored ({_STORED}) or deflated ({_DEFLATED}): unpack it to a folder",
            )
        _check_size(self.path / name, member.size)
        return member

    def _packed(self, name: str, member: _ZipMember, count: int) -> bytes:
        try:
            with self.path.open("rb") as stream:
                stream.seek(member.offset)
                signature, *lengths = _LOCAL_HEADER.unpack(stream.read(_LOCAL_HEADER.size))
                if signature != b"PK\3\4":
                    raise self._damaged(name)
                stream.seek(sum(lengths), os.SEEK_CUR)
                return stream.read(count)
        except struct.error:
            raise self._damaged(name) from None
        except OSError as error:
            raise BadInput(
                self.path, "file", f"unreadable ({error.strerror})", "a BTF database"
            ) from error

    def _unpacked(self, name: str, member: _ZipMember, packed: bytes, count: int) -> bytes:
        if member.method == _STORED:
            return packed[:count]
        try:
            return zlib.decompressobj(-zlib.MAX_WBITS).decompress(packed, count)
        except zlib.error:
            raise self._damaged(name) from None

    def _damaged(self, name: str) -> BadInput:
        return BadInput(
            self.path / name,
            "content",
            f"damaged inside the zip {self.path.name}",
            "a complete member",
        )


def zip_members(path: Path) -> ZipMembers:
    """The members of a zip. Raises BadInput where its directory cannot be read."""
    try:
        with zipfile.ZipFile(path) as archive:
            listed = [info for info in archive.infolist() if not info.is_dir()]
    except Exception as error:  # BadZipFile, and nearly anything for damaged directories
        raise BadInput(
            path, "content", "truncated or damaged", "a complete zip with its directory"
        ) from error
    # Some packers for Windows write backslashes.
    names = [info.filename.replace("\\", "/") for info in listed]
    members = {
        name: _ZipMember(
            info.header_offset,
            info.compress_size,
            info.file_size,
            info.CRC,
            info.compress_type,
            bool(info.flag_bits & 1),
        )
        for name, info in zip(names, listed, strict=True)
    }
    return ZipMembers(path, names, members)


@dataclass(frozen=True)
class JoinedMembers:
    """The members of all zips in a folder: a database in parts."""

    path: Path
    places: dict[str, tuple[ZipMembers, str]]

    def names(self) -> list[str]:
        """Paths inside, each behind its zip's."""
        return list(self.places)

    def size(self, name: str) -> int:
        """Bytes of a member, unpacked."""
        archive, member = self.places[name]
        return archive.size(member)

    def start(self, name: str, count: int) -> bytes:
        """About a member's first ``count`` bytes."""
        archive, member = self.places[name]
        return archive.start(member, count)

    def whole(self, name: str) -> bytes:
        """A member's content."""
        archive, member = self.places[name]
        return archive.whole(member)


def folder_members(path: Path) -> Members:
    """The files under a folder, or in the zips there where it holds nothing else but documents.

    Raises BadInput where a zip's directory cannot be read.
    """
    folder = FolderMembers(path)
    names = folder.names()
    zips = [name for name in names if name.lower().endswith(".zip")]
    if not zips or any(photograph_name(name) for name in names):
        return folder
    archives = {name: zip_members(path / name) for name in zips}
    return JoinedMembers(
        path,
        {
            f"{name}/{member}": (archive, member)
            for name, archive in archives.items()
            for member in archive.names()
        },
    )


@dataclass(frozen=True)
class FolderMembers:
    """The files under a folder."""

    path: Path

    def names(self) -> list[str]:
        """Paths inside, sorted; links to folders are followed, but not round in circles."""
        found: list[str] = []
        seen: set[tuple[int, int]] = set()
        for folder, below, files in os.walk(self.path, followlinks=True):
            here = os.stat(folder)
            if (here.st_dev, here.st_ino) in seen:
                below.clear()
                continue
            seen.add((here.st_dev, here.st_ino))
            below.sort()
            found += [(Path(folder) / file).relative_to(self.path).as_posix() for file in files]
        return sorted(found)

    def size(self, name: str) -> int:
        """Bytes of a file."""
        return check_file(self.path / name, _PHOTOGRAPH, largest=None)

    def start(self, name: str, count: int) -> bytes:
        """A file's first ``count`` bytes."""
        return first_bytes(self.path / name, count, _PHOTOGRAPH, largest=None)

    def whole(self, name: str) -> bytes:
        """A file's content."""
        _check_size(self.path / name, self.size(name))
        return self.start(name, LARGEST_MEMBER)


def _check_size(file: Path, size: int) -> None:
    if size > LARGEST_MEMBER:
        raise BadInput(
            file, "size", f"{size} bytes", f"at most {LARGEST_MEMBER // 1_000_000} MB a photograph"
        )
