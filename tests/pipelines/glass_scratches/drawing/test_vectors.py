"""Vectors of three numbers against NumPy's."""

from __future__ import annotations

import numpy as np

from pipelines.glass_scratches.drawing import vectors


def test_vectors_are_numpys() -> None:
    rng = np.random.default_rng(0)
    for a, b in rng.normal(size=(20, 2, 3)):
        one, other = tuple(a), tuple(b)
        np.testing.assert_array_equal(vectors.scaled(0.3, one), 0.3 * a)
        np.testing.assert_array_equal(vectors.divided(one, 0.3), a / 0.3)
        np.testing.assert_array_equal(vectors.stepped(one, -0.3, other), a - 0.3 * b)
        np.testing.assert_allclose(vectors.dot(one, other), a @ b, atol=1e-15)
        np.testing.assert_allclose(vectors.cross(one, other), np.cross(a, b), atol=1e-15)
        np.testing.assert_allclose(vectors.normalised(one), a / np.linalg.norm(a), atol=1e-15)


def test_a_product_of_nothing_has_no_sign() -> None:
    assert not np.signbit(vectors.dot((-0.0, 1.0, 0.0), (1.0, -0.0, -1.0)))


def test_rows_are_read_in_double_precision_and_written() -> None:
    rows = np.array([[0.1, 0.2, 0.3], [1.0, 2.0, 3.0]], np.float32)
    assert vectors.row_vector(rows, 0) == tuple(rows[0].astype(np.float64))
    vectors.set_row(rows, 1, (4.0, 5.0, 6.0))
    np.testing.assert_array_equal(rows[1], [4.0, 5.0, 6.0])
