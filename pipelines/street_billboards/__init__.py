"""Streets from eigen-textured billboards (docs/street.md)."""
