"""Names that people give, made safe for partition keys, folders and addresses."""

from __future__ import annotations

import hashlib
import re
import unicodedata

LONGEST = 64
_HASH_DIGITS = 8


def slug(name: str) -> str:
    """A key ``[a-z0-9_-]{1,64}`` for any name.

    A name that is a slug already stays as it is. Where slug and name differ, digits of the name's
    hash keep two names apart. Raises ValueError for an empty name.
    """
    if not name:
        raise ValueError("A name is empty; expected at least one character.")
    if re.fullmatch(r"[a-z0-9_-]{1,64}", name):
        return name
    plain = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode().lower()
    words = re.sub(r"[^a-z0-9_-]+", "-", plain).strip("-")
    digits = hashlib.sha256(name.encode("utf-8", "surrogatepass")).hexdigest()[:_HASH_DIGITS]
    return f"{words[: LONGEST - _HASH_DIGITS - 1]}-{digits}".lstrip("-")
