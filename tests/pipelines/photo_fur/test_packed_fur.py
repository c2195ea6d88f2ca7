"""What a package holds, against what it was made of."""

from __future__ import annotations

import io

import numpy as np
import pytest
from PIL import Image

from pipelines.drawing.colour import to_8bit
from pipelines.geometry.shapes import sphere, teapot
from pipelines.photo_fur.attenuation import Attenuation
from pipelines.photo_fur.laid_fur import Hair
from pipelines.photo_fur.lie_codes import hair_of_codes, lie_codes
from pipelines.photo_fur.packed_photograph import (
    one_colour_psnr_db,
    packed_photograph,
    photograph_psnr_db,
    unpacked_photograph,
)
from tests.fur_packages import packed_tufts, tufts

BACKWARDS = np.array([1.0, -0.2, 0.4])


def hair_along(normals: np.ndarray, seed: int = 0) -> Hair:
    random = np.random.default_rng(seed)
    anyhow = random.standard_normal(normals.shape)
    along = anyhow - normals * np.einsum("vi,vi->v", anyhow, normals)[:, None]
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    return Hair(along, random.random(len(normals)))


@pytest.mark.parametrize("mesh", [sphere(20), teapot(6)])
def test_directions_are_right_to_half_a_step(mesh: object) -> None:
    normals = mesh.normals  # type: ignore[attr-defined]
    hair = hair_along(normals)
    found = hair_of_codes(lie_codes(hair, normals, BACKWARDS), normals, BACKWARDS)
    cosine = np.einsum("vi,vi->v", hair.tangents, found.tangents)
    assert np.degrees(np.arccos(np.clip(cosine, -1, 1))).max() < 360 / 512 + 1e-3
    np.testing.assert_allclose(np.linalg.norm(found.tangents, axis=1), 1, atol=1e-6)
    assert np.abs(np.einsum("vi,vi->v", found.tangents, normals)).max() < 1e-5
    assert np.abs(found.lengths - hair.lengths).max() <= 0.5 / 255 + 1e-9
    # The null: codes of another way from nose to tail are other directions.
    other = hair_of_codes(lie_codes(hair, normals, BACKWARDS), normals, -BACKWARDS)
    assert np.median(np.einsum("vi,vi->v", hair.tangents, other.tangents)) < -0.99


def test_where_nose_to_tail_leads_straight_out_there_are_directions_too() -> None:
    normals = np.array([[1.0, 0, 0], [-1.0, 0, 0], [0, 0, 1.0]])
    hair = Hair(np.array([[0.0, 0.6, 0.8], [0.0, -1, 0], [0.0, 1, 0]]), np.ones(3))
    east = np.array([1.0, 0.0, 0.0])
    found = hair_of_codes(lie_codes(hair, normals, east), normals, east)
    assert np.einsum("vi,vi->v", hair.tangents, found.tangents).min() > np.cos(np.radians(0.71))


def test_the_photograph_is_read_back_as_another_reader_has_it() -> None:
    photo = tufts(shape=(40, 56))
    contents = [packed_photograph(photo, quality) for quality in (30, 90)]
    assert len(contents[0]) < len(contents[1])
    found = unpacked_photograph(contents[1], photo.attenuation, photo.opaque)
    codes = np.asarray(Image.open(io.BytesIO(contents[1])).convert("RGB"))
    np.testing.assert_array_equal(to_8bit(found.radiance), codes)
    assert found.attenuation == photo.attenuation
    assert found.opaque is photo.opaque
    np.testing.assert_allclose(
        found.luminance, found.radiance @ [0.2126, 0.7152, 0.0722], rtol=1e-5, atol=1e-7
    )
    assert photo.opaque is not None
    error = (codes.astype(float) - to_8bit(photo.radiance))[photo.opaque]
    expected = 20 * np.log10(255 / np.sqrt(np.mean(error**2)))
    psnr = [photograph_psnr_db(content, photo.radiance, photo.opaque) for content in contents]
    assert psnr[1] == pytest.approx(expected)
    assert psnr[1] > psnr[0] + 3
    alone = to_8bit(photo.radiance)[photo.opaque].astype(float)
    one = one_colour_psnr_db(photo.radiance, photo.opaque)
    assert one == pytest.approx(20 * np.log10(255 / np.sqrt(alone.var(axis=0).mean())))
    assert psnr[0] > one + 6
    assert photograph_psnr_db(contents[1], photo.radiance[::-1], photo.opaque[::-1]) < one


@pytest.mark.parametrize("content", [b"", b"no picture", b"\x00\x00\x00 ftypavif" + bytes(40)])
def test_what_is_no_avif_is_refused(content: bytes) -> None:
    with pytest.raises(ValueError, match=r"photograph is \d+ bytes that are no AVIF file\."):
        unpacked_photograph(content, Attenuation(0.8, 0.2), None)


def test_what_is_packed_lies_as_its_codes_say() -> None:
    packed = packed_tufts()
    fur = packed.fur()
    hair = hair_of_codes(packed.lie, packed.mesh.normals, packed.backwards)
    np.testing.assert_array_equal(fur.tangents, hair.tangents[fur.laying.vertex])
    np.testing.assert_array_equal(fur.lengths, hair.lengths[fur.laying.vertex])
    np.testing.assert_array_equal(fur.skin, packed.mesh.vertices[-1][fur.laying.vertex])
    # A patch shows in its middle what it was chosen for.
    at, shown = fur.laying, packed.patches
    patch = np.repeat(at.patches, 3, axis=0)
    corner = at.triangles.ravel()
    for slot in range(3):
        here = patch[:, slot] >= 0
        here[here] = at.vertex[corner[here]] == shown.middles[patch[here, slot]]
        if here.any():
            found = at.uvs[corner[here], slot]
            np.testing.assert_allclose(found, shown.places[patch[here, slot]], atol=1e-6)
