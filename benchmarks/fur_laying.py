"""Figures of the photograph laid over bodies: does it repeat, do its patches' borders show, is hair
equally wide, and does it lie as the field says? Each beside the paper's texture coordinates."""

from __future__ import annotations

import random
import statistics
import time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.colour import decode_srgb, luminance
from pipelines.drawing.stage import Camera, Light, Stage, orbit
from pipelines.geometry.eared_body import eared_body
from pipelines.geometry.meshes import Mesh
from pipelines.geometry.shapes import square
from pipelines.photo_fur import laid_fur
from pipelines.photo_fur.figures import laid_lie_error, strand_scale_spread
from pipelines.photo_fur.hair_length import hair_lengths
from pipelines.photo_fur.laid_fur import Hair, laid_surface
from pipelines.photo_fur.laying import (
    REACH,
    SLOTS,
    Body,
    Laying,
    choose_patches,
    lay,
    least_spacing,
)
from pipelines.photo_fur.lie import guides_backwards, lie_field, nose_to_tail
from pipelines.photo_fur.packed_fur import Laid
from pipelines.photo_fur.photograph import FurPhotograph
from pipelines.photo_fur.photograph_lie import (
    PhotographLie,
    disc_radius,
    photograph_lie,
    pieces_of,
)
from pipelines.photo_fur.shells import ShellMesh, make_shell_mesh, mesh_radius
from pipelines.photo_fur.stage_view import FurLight, fur_texture, live_surface

_LAYERS = 15
_WIDTHS = 3.0
"""Of the photograph, along a side of the sheet."""
_PICTURE = 768
_FAR = 0.2
"""Photograph widths from which on likeness is repetition."""
_WINDOW, _TURNS = (640, 480), 21
_HARD = 50.0
"""Of a patch's hairs, how much taller its middle is where borders are cuts: the null."""


def laying_figures(photograph: FurPhotograph) -> dict[str, Any]:
    """On a sheet three photographs wide, and on the eared body; photograph: square, periodic."""
    lie = photograph_lie(photograph.luminance)
    return _sheet(photograph, lie) | _body(photograph, lie)


def _sheet(photograph: FurPhotograph, lie: PhotographLie) -> dict[str, Any]:
    flat = square(96)
    points = flat.vertices * _WIDTHS
    east = np.tile([1.0, 0.0, 0.0], (len(points), 1))
    spacing = disc_radius(lie.direction.shape) / REACH
    pieces = pieces_of(lie, REACH * spacing, None, photograph.radiance)
    sheet = Body(points, flat.triangles, east, flat.normals)
    patches = choose_patches(sheet, pieces, spacing=spacing)
    laying = lay(sheet, patches, spacing=spacing, width=1.0)
    drawn = _from_above(photograph, points, east, laying)
    tiled = Mesh(points, flat.triangles, points[:, :2] + _WIDTHS / 2, flat.normals)
    plain = _from_above(photograph, points, east, laid_by_coordinates(tiled))
    blend = laid_fur.HEIGHT_OF_WEIGHT
    try:
        laid_fur.HEIGHT_OF_WEIGHT = _HARD
        cut = _from_above(photograph, points, east, laying)
    finally:
        laid_fur.HEIGHT_OF_WEIGHT = blend
    borders = _borders(points, laying)
    return {
        "repetition": repetition(drawn),
        "repetition_plain": repetition(plain),
        "seam_ratio": seam_ratio(drawn, borders),
        "seam_ratio_plain": seam_ratio(cut, borders),
        "seam_share": float(borders.mean()),
    }


def laid_over_body(photograph: FurPhotograph) -> tuple[ShellMesh, Laid]:
    """The eared body, and a square photograph on it, as the graph's defaults have it."""
    mesh = make_shell_mesh(eared_body(), _LAYERS)
    skin, radius = mesh.vertices[-1], mesh_radius(mesh.vertices[-1])
    backwards = nose_to_tail(skin)
    guides = guides_backwards(mesh.normals, backwards, 0.5)
    tangents = lie_field(skin, mesh.normals, mesh.triangles, guides, 0.12 * radius).tangents
    lie, width = photograph_lie(photograph.luminance), 0.8 * radius
    usual = disc_radius(lie.direction.shape) / REACH * width
    spacing = max(usual, least_spacing(skin.astype(np.float64), mesh.triangles))
    pieces = pieces_of(lie, REACH * spacing / width, None, photograph.radiance)
    body = Body(skin, mesh.triangles, tangents, mesh.normals)
    patches = choose_patches(body, pieces, spacing=spacing)
    hair = Hair(tangents, hair_lengths(skin, mesh.normals, mesh.triangles))
    return mesh, Laid(hair, backwards, patches, spacing, width)


def _body(photograph: FurPhotograph, lie: PhotographLie) -> dict[str, Any]:
    body, (mesh, laid) = eared_body(), laid_over_body(photograph)
    skin, tangents = mesh.vertices[-1], laid.hair.tangents
    haired = Body(skin, mesh.triangles, tangents, mesh.normals)
    laying = lay(haired, laid.patches, spacing=laid.spacing, width=laid.width)
    layings = {"": laying, "_plain": laid_by_coordinates(body)}
    found: dict[str, Any] = {"patches": len(laid.patches.middles)}
    found |= _frame_ratio(photograph, body, tangents, laying)
    for name, each in layings.items():
        found[f"strand_scale_spread{name}"] = strand_scale_spread(skin, each)
        found[f"lie_error_deg{name}"] = laid_lie_error(
            skin, tangents, each, lie.direction, lie.coherence
        )
    return found


def _frame_ratio(
    photograph: FurPhotograph, body: Mesh, tangents: NDArray[np.floating], laying: Laying
) -> dict[str, Any]:
    """Frames of the full look over the plain one's, medians of turns on one stage, both with their
    lamps in the shader; and by how much more vertices the full look has."""
    thickness = 0.06 * mesh_radius(body.vertices)
    image = fur_texture(photograph, _LAYERS, tails="end layers")
    light = FurLight(sky=0.15, headlight=0.35, lamp=0.75, light=(0.0, -0.6, 0.8))
    plain = live_surface(
        body.vertices.astype(np.float32),
        body.normals,
        body.triangles,
        coordinates_of(body),
        image,
        photograph.attenuation,
        layers=_LAYERS,
        thickness=thickness,
        fill="columns",
        light=light,
    )
    hair = Hair(tangents, np.ones(len(tangents)))
    fur = laid_fur.laid_fur(body.vertices, body.normals, hair, laying, thickness, _LAYERS)
    full = laid_surface(fur, image, photograph.attenuation, light)
    with Stage(*_WINDOW, background=(0.1, 0.1, 0.1)) as stage:
        stage.add(plain, full)
        stage.light(Light())
        stage.look(orbit((0.0, 0.0, 0.0), 5.0, -60.0, 15.0))
        spent: dict[str, list[float]] = {"full": [], "plain": []}
        for turn in range(_TURNS + 1):
            for name in random.Random(turn).sample(sorted(spent), 2):
                full.SetVisibility(name == "full")
                plain.SetVisibility(name == "plain")
                started = time.perf_counter()
                stage.draw()
                if turn:
                    spent[name].append(time.perf_counter() - started)
    medians = {name: statistics.median(each) for name, each in spent.items()}
    return {
        "full_frame_ratio": medians["full"] / medians["plain"],
        "full_frame_ms": 1000 * medians["full"],
        "full_vertices_ratio": len(laying.vertex) / len(body.vertices),
    }


def repetition(grey: NDArray[np.floating]) -> float:
    """Highest correlation of a picture (y, x), `_WIDTHS` photographs wide, with itself shifted by
    `_FAR` photograph widths or more, without its shading; 1 for tiles."""
    from scipy.ndimage import gaussian_filter

    width = grey.shape[1] / _WIDTHS
    fine = grey - gaussian_filter(grey, 0.1 * width)
    padded = [2 * length for length in fine.shape]
    power = np.abs(np.fft.rfft2(fine, padded)) ** 2
    shifted = np.fft.irfft2(power, padded)
    rows, columns = (np.fft.fftfreq(length, 1 / length) for length in padded)
    rows, columns = rows[:, None], columns[None]
    overlap = (1 - np.abs(rows) / fine.shape[0]) * (1 - np.abs(columns) / fine.shape[1])
    inside = (np.hypot(rows, columns) >= _FAR * width) & (overlap > 0.3)
    likeness = shifted / np.maximum(overlap, 0.3) / shifted[0, 0]
    return float(likeness[inside].max())


def seam_ratio(grey: NDArray[np.floating], borders: NDArray[np.bool_]) -> float:
    """Mean gradient of a picture (y, x) where patches meet over that elsewhere; 1: no border
    shows."""
    from scipy.ndimage import gaussian_gradient_magnitude

    steps = gaussian_gradient_magnitude(grey, 1.0)
    return float(steps[borders].mean() / steps[~borders].mean())


def laid_by_coordinates(mesh: Mesh) -> Laying:
    """The photograph by a mesh's own texture coordinates, in one patch."""
    count = len(mesh.vertices)
    places = np.zeros((count, SLOTS, 2), np.float32)
    places[:, 0] = coordinates_of(mesh)
    weights = np.zeros((count, SLOTS), np.float32)
    weights[:, 0] = 1.0
    shown = np.full((len(mesh.triangles), SLOTS), -1, np.int64)
    shown[:, 0] = 0
    triangles = mesh.triangles.astype(np.int32)
    return Laying(np.arange(count), triangles, places, weights, shown)


def coordinates_of(mesh: Mesh) -> NDArray[np.floating]:
    """Texture coordinates (V, 2) of a mesh that has them."""
    assert mesh.uvs is not None
    return mesh.uvs


def _from_above(
    photograph: FurPhotograph,
    points: NDArray[np.floating],
    tangents: NDArray[np.floating],
    laying: Laying,
) -> NDArray[np.floating]:
    """Luminance (y, x) of the sheet from straight above, as it was photographed."""
    upright = np.tile([0.0, 0.0, 1.0], (len(points), 1))
    hair = Hair(tangents, np.ones(len(points)))
    fur = laid_fur.laid_fur(points, upright, hair, laying, 1e-3, _LAYERS)
    image = fur_texture(photograph, _LAYERS, tails="end layers")
    light = FurLight(sky=1.0, headlight=0.0)
    black = (0.0, 0.0, 0.0)
    with Stage(_PICTURE, _PICTURE, background=black, supersampling=2) as stage:
        stage.add(laid_surface(fur, image, photograph.attenuation, light))
        stage.light(Light())
        stage.look(Camera((0.0, 0.0, 9.0), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), 30.0, _WIDTHS))
        return luminance(decode_srgb(stage.frame() / 255.0))


def _borders(points: NDArray[np.floating], laying: Laying) -> NDArray[np.bool_]:
    """(y, x): where two patches weigh about the same, in the picture from above."""
    from scipy.interpolate import griddata

    weights = np.sort(laying.weights.astype(np.float64), axis=1)
    lead = weights[:, -1] - weights[:, -2]
    places, first = np.unique(laying.vertex, return_index=True)
    along = (np.arange(_PICTURE) + 0.5) / _PICTURE * _WIDTHS - _WIDTHS / 2
    x, y = np.meshgrid(along, -along)
    found = griddata(points[places, :2], lead[first], (x, y), method="nearest")
    return np.asarray(found < 0.1)
