"""JSON documents that hold the hash of their own bytes, their *seal*: one flipped bit is noticed.

A document has a seal where it has the entry ``"seal": BLANK`` somewhere when it is written; the
hash is that of the document with the blank seal. Documents without one are read, too.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Mapping
from typing import Any, BinaryIO

SEAL = "seal"
BLANK = "0" * 64
_SEALED = re.compile(rb'"seal": "([0-9a-f]{64})"')
_BLANK = f'"{SEAL}": "{BLANK}"'.encode()


def dump(document: Mapping[str, Any], file: BinaryIO) -> None:
    """Write a document; where it has a blank seal, that becomes the hash."""
    data = json.dumps(document, indent=2).encode()
    seal = hashlib.sha256(data).hexdigest()
    file.write(data.replace(_BLANK, f'"{SEAL}": "{seal}"'.encode(), 1))


def loads(data: bytes) -> dict[str, Any]:
    """The document that these bytes are. Raises ValueError where it or its seal is broken.

    >>> import io
    >>> file = io.BytesIO()
    >>> dump({"version": "one", "seal": BLANK}, file)
    >>> loads(file.getvalue())["version"]
    'one'
    >>> loads(file.getvalue().replace(b"one", b"onf"))
    Traceback (most recent call last):
    ValueError: its bytes do not have the hash that was noted with them
    """
    document = json.loads(data)
    if not isinstance(document, dict):
        raise ValueError("it is no JSON object")
    found = _SEALED.search(data)
    if found is None and f'"{SEAL}"'.encode() in data:
        raise ValueError("its seal is broken")
    if found is not None:
        blank = data[: found.start()] + _BLANK + data[found.end() :]
        if hashlib.sha256(blank).hexdigest() != found[1].decode():
            raise ValueError("its bytes do not have the hash that was noted with them")
    return document
