"""The eared body: closed, all of it there, and refused where its ears would be lost."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from pipelines.geometry.eared_body import eared_body


def test_it_is_one_closed_body_of_about_its_parts_volume() -> None:
    body = eared_body(40)
    joined = trimesh.Trimesh(body.vertices, body.triangles, process=False)
    joined.merge_vertices(merge_tex=True, merge_norm=True)
    assert joined.is_watertight
    assert joined.body_count == 1
    assert joined.volume == pytest.approx(0.8, rel=0.05)


def test_ears_legs_and_tail_stick_out() -> None:
    vertices = eared_body(40).vertices
    for sign in (-1, 1):
        assert (sign * vertices[vertices[:, 2] > 0.8][:, 1] > 0.15).any()  # ears
        assert (sign * vertices[vertices[:, 2] < -0.7][:, 1] > 0.15).any()  # feet
    assert (vertices[:, 0] < -1.15).any()  # tail
    # Between the ears, and between the legs, is nothing.
    between = np.abs(vertices[:, 1]) < 0.05
    assert not (between & (vertices[:, 2] > 0.8)).any()
    assert not (between & (vertices[:, 2] < -0.5)).any()


def test_too_coarse_a_grid_is_refused() -> None:
    with pytest.raises(ValueError, match="expected at least 24"):
        eared_body(12)
