"""Users' files to arrays. Nothing else in the project opens them.

Whatever cannot be used is refused with :class:`BadInput`: one sentence that names the file, the
field, what was found and what was expected.
"""

from storage.readers.bad_input import BadInput

__all__ = ["BadInput"]
