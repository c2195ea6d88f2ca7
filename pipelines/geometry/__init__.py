"""Meshes and solids, their repair, rays (Embree), cameras."""
