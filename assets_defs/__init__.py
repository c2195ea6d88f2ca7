"""Dagster: thin assets over `pipelines` and `storage`, their checks, and what launches them."""
