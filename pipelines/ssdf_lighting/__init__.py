"""Image-based lighting by spherical signed distance functions (paper 4; docs/ssdf.md)."""
