"""Everything on disk: the versioned Zarr store, its IO manager, schemas and users' files."""
