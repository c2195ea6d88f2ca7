"""Numerics: arrays in, arrays out. Knows neither Dagster nor Zarr nor files."""
