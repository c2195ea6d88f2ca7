"""What can go wrong with stored data, each said in one sentence."""


class StoreError(Exception):
    """A version cannot be written, read or moved; nothing already stored was changed."""


class NoVersionError(StoreError):
    """The asset's partition has no version that has passed its checks."""


class MissingChunkError(StoreError):
    """A stored array lacks a chunk that its shape demands."""


class StoreFullError(StoreError):
    """The disk has no room for a new version."""


class SchemaError(StoreError):
    """A dataset is not what its schema declares."""
