"""The compressed BTF for programs that know nothing of the store: `btf_package`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from typing import TYPE_CHECKING, Any, ClassVar

from pydantic import Field

from assets_defs.neural_btf.datasets import btf_file_of, runtime_btf
from assets_defs.neural_btf.declaration import BTF, NONE
from assets_defs.packages import PackageSettings, package_dataset, read_back_check
from assets_defs.settings import Preset
from assets_defs.system import Result
from pipelines.virtual.cloth.weaves import MATERIALS
from storage.schemas import neural_btf as schemas
from storage.stored_version import StoredVersion

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr
    from numpy.typing import NDArray

    from pipelines.neural_btf.compressed import CompressedBtf
    from pipelines.neural_btf.live_parts import ReferenceView
    from pipelines.neural_btf.stage_view import Scenery
    from storage.btf_file import BtfFile
    from storage.btf_file.contents import Tensor
    from storage.packages import Figure, PaperFigure, Source, View

_BUILT_IN = "Apache-2.0 (made by Tsuya)"
_COLUMNS = (NONE, "500", "1000", "2000")
_TABLE_2 = {
    "silk": ("fabric02, silk", (0.0203, 0.0212, 0.0200, 0.0203)),
    "knit": ("WOOL, a knit", (0.0264, 0.0275, 0.0274, 0.0274)),
    "corduroy": ("CORDUROY", (0.0285, 0.0289, 0.0282, 0.0288)),
}
"""RMSE of the paper's material that is nearest to a built-in one, by columns."""
_TABLE_1 = (417_532.0, 153_532.0, 169_532.0, 201_532.0)
"""Bytes of decoder, latents and index list, for 10 000 texels, by columns."""


class BtfPackageSettings(PackageSettings):
    """The pictures that the package holds."""

    view_width: int = Field(160, ge=32, le=1024, description="Of its reference pictures, 4:3")
    poster_width: int = Field(640, ge=32, le=2048, description="Of its poster, 4:3")
    cloth_tiles: float = Field(
        4.0, gt=0.0, le=100.0, description="Tiles over the hanging cloth's width"
    )

    sizes: ClassVar[Mapping[Preset, Mapping[str, object]]] = {
        "test": {"view_width": 64, "poster_width": 96, "cloth_tiles": 1.0},
    }


def _expected(version: StoredVersion) -> dict[str, Any]:
    """Parts as the file in the store has them: all that is of whole numbers, and their steps."""
    import numpy as np

    from storage.btf_file import Quantised, values_of
    from storage.packages.neural_btf import TENSORS

    file = btf_file_of(version.input("compressed_btf"))
    student = {f"student_{name}": part for name, part in file.student.items()}
    tensors = {**file.decoder, **student, "latents": file.latents}
    expected: dict[str, Any] = {
        name: part.symbols.astype(np.int8) if isinstance(part, Quantised) else values_of(part)
        for name, part in tensors.items()
    }
    for prefix, decoder in (("", file.decoder), ("student_", file.student)):
        found = [part.step for part in decoder.values() if isinstance(part, Quantised)]
        if len(found) == len(TENSORS):
            in_order = [tuple(decoder).index(name) for name in TENSORS]
            expected[f"{prefix}steps"] = np.array(found)[in_order]
    if isinstance(file.latents, Quantised):
        expected["latent_steps"] = file.latents.step
    if file.mips:
        expected["mip_steps"] = file.mips[0].step
        expected["mips"] = np.concatenate([level.symbols for level in file.mips]).astype(np.int8)
    if file.parallax is not None:
        expected["parallax"] = file.parallax
    if file.ids is not None:
        expected["ids"] = file.ids.astype(np.min_scalar_type(len(expected["latents"]) - 1))
    return expected


@BTF.asset(
    schemas.BTF_PACKAGE,
    by=("material", "clusters"),
    settings=BtfPackageSettings,
    inputs=("compressed_btf", "restored_images"),
    kinds=frozenset({"zarr", "pyvista"}),
    checks=(read_back_check(_expected),),
)
def btf_package(
    settings: BtfPackageSettings,
    keys: Mapping[str, str],
    lineage: Sequence[Mapping[str, Any]],
    compressed_btf: xr.Dataset,
    restored_images: xr.Dataset,
) -> Result:
    """Pack decoder, latents and a hanging cloth, and draw the reference views."""
    from pipelines.neural_btf.live_parts import home_exposure, reference_views, scenery_of
    from storage.packages import Contents, write_package
    from storage.packages.neural_btf import package_schema

    file = btf_file_of(compressed_btf)
    scenery, tiles = scenery_of(runtime_btf(file)), settings.cloth_tiles
    exposure = home_exposure(scenery, tiles)
    views = reference_views(scenery, tiles, exposure, settings.view_width)
    photograph = restored_images["original"].values[0]
    values = _values(file, scenery)
    values |= _pictures(settings, scenery, exposure, views, photograph)
    parameters = packed_parameters(file) | {"tiles": tiles, "exposure": exposure}
    figures = _figures(keys, scenery.btf, restored_images, compressed_btf.sizes["byte"])
    about = Contents(_title(keys), [_source(settings, keys)], values, parameters)
    about = replace(about, views=[_view(view) for view in views], figures=figures, lineage=lineage)
    content = write_package(package_schema(packed_numbers(file)), about)
    return package_dataset(content), {"bytes": len(content), "views": len(views)}


def packed_numbers(file: BtfFile) -> dict[str, Any]:
    """Array parts of a package: numbers as the file has them, and their steps."""
    import numpy as np

    from storage.btf_file import Quantised
    from storage.packages.neural_btf import STUDENT, TENSORS

    def packed(tensor: Tensor) -> NDArray[Any]:
        return tensor.symbols.astype(np.int8) if isinstance(tensor, Quantised) else tensor

    def step(tensor: Tensor) -> NDArray[np.float32]:
        return tensor.step if isinstance(tensor, Quantised) else np.ones((), np.float32)

    values: dict[str, Any] = {}
    for prefix, decoder in (("", file.decoder), (STUDENT, file.student)):
        if decoder:
            values |= {prefix + name: packed(decoder[name]) for name in TENSORS}
            values[f"{prefix}steps"] = np.array([step(decoder[name]) for name in TENSORS])
    values["latents"] = packed(file.latents)
    values["latent_steps"] = np.broadcast_to(step(file.latents), values["latents"].shape[-1:])
    if file.ids is not None:
        values["ids"] = file.ids.astype(np.min_scalar_type(len(values["latents"]) - 1))
    if file.mips:
        values["mips"] = np.concatenate([packed(level) for level in file.mips])
        values["mip_steps"] = file.mips[0].step
    if file.parallax is not None:
        values["parallax"] = file.parallax
    return values


def packed_parameters(file: BtfFile) -> dict[str, Any]:
    """Parameters of a package that the file has; an infinite bound is the largest float32."""
    import numpy as np

    most = float(np.finfo(np.float32).max)
    bounds = {"least": max(file.least, -most), "largest": min(file.largest, most)}
    return {"alpha": file.alpha, "height": file.height, "width": file.width, **bounds}


def _values(file: BtfFile, scenery: Scenery) -> dict[str, Any]:
    from storage.packages import Mesh

    _, cloth, around = scenery
    assert around is not None
    return {
        **packed_numbers(file),
        "cloth": Mesh(
            cloth.vertices,
            cloth.triangles,
            cloth.normals,
            cloth.places,
            {"TANGENT": cloth.tangents},
        ),
        "room": Mesh(around.vertices, around.triangles, attributes={"RADIANCE": around.radiance}),
    }


def _pictures(
    settings: BtfPackageSettings,
    scenery: Scenery,
    exposure: float,
    views: Sequence[ReferenceView],
    photograph: NDArray[np.floating],
) -> dict[str, Any]:
    from pipelines.neural_btf.live_parts import input_picture, poster

    return {
        **{f"reference_{view.name}": view.frame for view in views},
        "poster": poster(scenery, settings.cloth_tiles, exposure, settings.poster_width),
        "input": input_picture(photograph),
    }


def _view(view: ReferenceView) -> View:
    from pipelines.neural_btf.live_parts import SUPERSAMPLING
    from storage.packages import View

    height, width, _ = view.frame.shape
    state = {"light": list(view.light), "tiles": view.tiles, "exposure": 0.0}
    camera = asdict(view.camera)
    return View(view.name, f"reference_{view.name}", width, height, SUPERSAMPLING, camera, state)


def _title(keys: Mapping[str, str]) -> str:
    clusters = keys["clusters"]
    shared = "latents for each texel" if clusters == NONE else f"{clusters} latents"
    return f"{keys['material']}, {shared}"


def _source(settings: BtfPackageSettings, keys: Mapping[str, str]) -> Source:
    from storage.packages import Source

    material = keys["material"]
    given = settings.licence or "not stated"
    return Source(material, _BUILT_IN if material in MATERIALS else given)


def _figures(
    keys: Mapping[str, str], btf: CompressedBtf, restored_images: xr.Dataset, file_bytes: int
) -> list[Figure]:
    """Errors and bytes, the paper's tables beside them where they have such a row and column."""
    from storage.packages import Figure, PaperFigure

    told: PaperFigure | None = None
    size: PaperFigure | None = None
    if keys["clusters"] in _COLUMNS:
        column = _COLUMNS.index(keys["clusters"])
        words = "no clusters" if column == 0 else f"k = {keys['clusters']}"
        size = PaperFigure(_TABLE_1[column], f"table 1, {words}, 10 000 texels")
        if keys["material"] in _TABLE_2:
            row, errors = _TABLE_2[keys["material"]]
            told = PaperFigure(errors[column], f"table 2, {row}, {words}")
    return [
        Figure("RMSE over alpha", float(restored_images["rmse"]), "1", told),
        Figure("Compressed BTF, one file", float(file_bytes), "byte", size),
        Figure("Texels", float(btf.texels)),
        Figure("Latent vectors", float(len(btf.latents))),
    ]
