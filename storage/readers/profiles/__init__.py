"""Cross-sections of scratches: the text files of profilers and microscopes to points."""

from storage.readers.profiles.reading import ProfileFile, read_profile

__all__ = ["ProfileFile", "read_profile"]
