"""Figures of the fur as a package holds it: bytes, what they cost in the pictures, and how few
shells do far away. Each beside what knows nothing."""

from __future__ import annotations

import io
import json
import random
import statistics
import time
import zipfile
import zlib
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from assets_defs.photo_fur.package import FurPackageSettings, package_contents
from benchmarks.fur_laying import laid_over_body
from pipelines.drawing.picture_metrics import ssim_map
from pipelines.drawing.stage import Light, Stage
from pipelines.photo_fur.frames import BACKGROUND, ROUND_VIEWS, view_cameras
from pipelines.photo_fur.laid_fur import (
    LaidFur,
    laid_fur,
    laid_surface,
    rows_of_fur,
    shells_seen,
)
from pipelines.photo_fur.laying import Body, lay
from pipelines.photo_fur.live_parts import OUTDOORS, nearer
from pipelines.photo_fur.packed_fur import Laid, PackedFur, packed_fur
from pipelines.photo_fur.photograph import FurPhotograph
from pipelines.photo_fur.shells import ShellMesh
from pipelines.photo_fur.stage_view import fur_texture
from storage.packages import Source, write_package
from storage.packages.photo_fur import PACKAGE

_SIZE = (480, 640)
_SAMPLES = 2
_TURNS = 21
_DISTANCES = (4.0, 8.0, 16.0)
"""In distances from which the body fills the picture."""
_OF_THE_MESH = ("mesh",)
_OF_A_ZIP = 30 + 46
"""Bytes of an entry beside its content and, twice, its name."""


def asset_figures(photograph: FurPhotograph) -> dict[str, Any]:
    """Of a photograph on the eared body, at the package's own quality."""
    mesh, laid = laid_over_body(photograph)
    settings = FurPackageSettings()
    packed = packed_fur(photograph, mesh, laid, settings.photograph_quality)
    whole = _unpacked(mesh, laid)
    bytes_found = asset_bytes(packed, settings)
    expected = _frames(photograph, whole)
    fur = expected[..., 3] > 0

    def psnrs(name: str, found: NDArray[np.floating]) -> dict[str, float]:
        return {
            f"asset_psnr_db{name}": _psnr(found[..., :3], expected[..., :3]),
            f"asset_psnr_fur_db{name}": _psnr(found[..., :3][fur], expected[..., :3][fur]),
        }

    seen = packed.photograph()
    straight = packed._replace(lie=np.stack([0 * packed.lie[0], packed.lie[1]])).fur()
    return {
        **bytes_found,
        **psnrs("", _frames(seen, packed.fur())),
        **psnrs("_jpeg", _frames(_as_jpeg(photograph, len(packed.file)), packed.fur())),
        **psnrs("_null_photograph", _frames(_one_colour(seen), packed.fur())),
        **psnrs("_null_lie", _frames(seen, straight)),
        **_detail(photograph, whole, mesh),
    }


def asset_bytes(packed: PackedFur, settings: FurPackageSettings) -> dict[str, Any]:
    """Bytes of photograph, field, patches and numbers, packed, with what the zip adds; without the
    mesh, which is the user's, and without pictures to look at."""
    small = settings.model_copy(update={"view_width": 32, "poster_width": 32})
    contents = package_contents(small, packed, [Source("a"), Source("b")], [], "full")
    content = write_package(PACKAGE, contents)
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        parts = {
            entry.filename.partition(".")[0]: entry.compress_size
            + _OF_A_ZIP
            + 2 * len(entry.filename)
            for entry in archive.infolist()
            if entry.filename.partition(".")[0] in set(PACKAGE.parts) - set(_OF_THE_MESH)
        }
    numbers = len(zlib.compress(json.dumps(contents.parameters).encode(), 9))
    return {
        "asset_bytes": sum(parts.values()) + numbers,
        "asset_bytes_each": parts | {"numbers": numbers},
        "asset_pixels": list(packed.photograph().luminance.shape),
    }


def _unpacked(mesh: ShellMesh, laid: Laid) -> LaidFur:
    """As the graph draws it: nothing is rounded."""
    skin = mesh.vertices[-1]
    body = Body(skin, mesh.triangles, laid.hair.tangents, mesh.normals)
    laying = lay(body, laid.patches, spacing=laid.spacing, width=laid.width)
    return laid_fur(skin, mesh.normals, laid.hair, laying, mesh.thickness, mesh.layers)


def _frames(photograph: FurPhotograph, fur: LaidFur) -> NDArray[np.floating]:
    """The four sides, (view, y, x, 4): 8-bit codes and, in alpha, the fur's share."""
    from pipelines.drawing.colour import to_8bit

    image = fur_texture(photograph, fur.layers, tails="end layers")
    found = []
    for camera in view_cameras(ROUND_VIEWS, fur.reach, _SIZE[1] / _SIZE[0]):
        with Stage(_SIZE[1], _SIZE[0], background=BACKGROUND, supersampling=_SAMPLES) as stage:
            rows = rows_of_fur(camera, fur.skin, fur.thickness, _SAMPLES * _SIZE[0])
            shells = shells_seen(rows)
            stage.add(laid_surface(fur, image, photograph.attenuation, OUTDOORS, shells=shells))
            stage.light(Light())
            stage.look(camera)
            drawn = stage.radiance()
        found.append(np.dstack([to_8bit(drawn[..., :3]), drawn[..., 3]]))
    return np.stack(found)


def _psnr(one: NDArray[np.floating], other: NDArray[np.floating]) -> float:
    return float(10 * np.log10(255**2 / max(float(((one - other) ** 2).mean()), 1e-9)))


def _as_jpeg(photograph: FurPhotograph, most: int) -> FurPhotograph:
    """The photograph through the best JPEG of at most so many bytes."""
    from PIL import Image

    from pipelines.drawing.colour import decode_srgb, luminance
    from pipelines.photo_fur.photograph import fur_colours

    picture, best = Image.fromarray(fur_colours(photograph)), b""
    for quality in range(5, 96):
        file = io.BytesIO()
        picture.save(file, "JPEG", quality=quality, optimize=True, progressive=True)
        if len(file.getvalue()) <= most:
            best = file.getvalue()
    radiance = decode_srgb(np.asarray(Image.open(io.BytesIO(best))) / 255.0).astype(np.float32)
    return photograph._replace(radiance=radiance, luminance=luminance(radiance))


def _one_colour(photograph: FurPhotograph) -> FurPhotograph:
    """Its mean colour everywhere: what one would see of fur of which nothing is known."""
    from pipelines.drawing.colour import luminance

    mean = np.broadcast_to(photograph.radiance.mean(axis=(0, 1)), photograph.radiance.shape)
    return photograph._replace(radiance=mean, luminance=luminance(mean.astype(np.float32)))


# ---- level of detail -------------------------------------------------------------------------


def _detail(photograph: FurPhotograph, fur: LaidFur, mesh: ShellMesh) -> dict[str, Any]:
    """From afar: frames with as many shells as are needed over frames with one a layer, in turns on
    one stage; SSIM of the two where the body is; and of frames whose shells differ by one, which is
    all that is seen of a step. The ratio of the farthest, SSIM of the worst; the null has a
    single shell."""
    image = fur_texture(photograph, fur.layers, tails="end layers")
    ratios, likeness, steps, nulls, shells = [], [], [], [], {}
    (near,) = view_cameras(ROUND_VIEWS[:1], fur.reach, _SIZE[1] / _SIZE[0])
    for times in _DISTANCES:
        camera = nearer(near, times)
        rows = rows_of_fur(camera, mesh.vertices[-1], fur.thickness, _SAMPLES * _SIZE[0])
        seen = min(fur.layers, shells_seen(rows))
        shells[f"{times:g}"] = seen
        counts = {"all": fur.layers, "seen": seen, "one fewer": seen - 1, "one": 1}
        with Stage(_SIZE[1], _SIZE[0], background=BACKGROUND, supersampling=_SAMPLES) as stage:
            actors = {
                name: laid_surface(fur, image, photograph.attenuation, OUTDOORS, shells=count)
                for name, count in counts.items()
            }
            stage.add(*actors.values())
            stage.light(Light())
            stage.look(camera)
            pictures = {name: _shown(stage, actors, name) for name in counts}
            ratios.append(_time_ratio(stage, actors))
        body = _box((pictures["all"] != pictures["all"][0, 0]).any(axis=-1))
        crops = {name: picture[body] for name, picture in pictures.items()}
        likeness.append(float(ssim_map(crops["seen"], crops["all"]).mean()))
        steps.append(float(ssim_map(crops["one fewer"], crops["seen"]).mean()))
        nulls.append(float(ssim_map(crops["one"], crops["all"]).mean()))
    return {
        "lod_frame_ratio": ratios[-1],
        "lod_frame_ratio_each": ratios,
        "lod_ssim": min(likeness),
        "lod_ssim_each": likeness,
        "lod_ssim_null": max(nulls),
        "lod_step_ssim": min(steps),
        "lod_shells": shells,
    }


def _shown(stage: Stage, actors: Mapping[str, Any], name: str) -> NDArray[np.uint8]:
    for other, actor in actors.items():
        actor.SetVisibility(other == name)
    return stage.frame()


def _time_ratio(stage: Stage, actors: Mapping[str, Any]) -> float:
    spent: dict[str, list[float]] = {"all": [], "seen": []}
    for turn in range(_TURNS + 1):
        for name in random.Random(turn).sample(sorted(spent), 2):
            for other, actor in actors.items():
                actor.SetVisibility(other == name)
            started = time.perf_counter()
            stage.draw()
            if turn:
                spent[name].append(time.perf_counter() - started)
    return statistics.median(spent["seen"]) / statistics.median(spent["all"])


def _box(inside: NDArray[np.bool_]) -> tuple[slice, slice]:
    rows, columns = np.flatnonzero(inside.any(axis=1)), np.flatnonzero(inside.any(axis=0))
    return slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1)
