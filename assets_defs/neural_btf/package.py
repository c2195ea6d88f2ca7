"""The compressed BTF for programs that know nothing of the store: `btf_package`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any, ClassVar

from pydantic import Field

from assets_defs.neural_btf.datasets import compressed_btf_of
from assets_defs.neural_btf.declaration import BTF, NONE
from assets_defs.packages import PackageSettings, package_dataset, read_back_check
from assets_defs.settings import Preset
from assets_defs.system import Result
from pipelines.neural_btf.decoder_arrays import DECODER_ARRAY_NAMES
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
    """Parts as the datasets have them."""
    import numpy as np

    btf = version.input("compressed_btf")
    expected = {name: btf[name].values for name in (*DECODER_ARRAY_NAMES, "latents")}
    if "ids" in btf:
        expected["ids"] = btf["ids"].values.astype(np.min_scalar_type(len(expected["latents"]) - 1))
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

    scenery, tiles = scenery_of(compressed_btf_of(compressed_btf)), settings.cloth_tiles
    exposure = home_exposure(scenery, tiles)
    views = reference_views(scenery, tiles, exposure, settings.view_width)
    parameters = _parameters(scenery.btf) | {"tiles": tiles, "exposure": exposure}
    photograph = restored_images["original"].values[0]
    values = _values(scenery) | _pictures(settings, scenery, exposure, views, photograph)
    figures = _figures(keys, scenery.btf, float(restored_images["rmse"]))
    title, shown = _title(keys), [_view(view) for view in views]
    content = write_package(
        package_schema(str(_ids_type(scenery.btf))),
        Contents(title, [_source(settings, keys)], values, parameters, shown, figures, lineage),
    )
    return package_dataset(content), {"bytes": len(content), "views": len(views)}


def _values(scenery: Scenery) -> dict[str, Any]:
    from storage.packages import Mesh

    btf, cloth, around = scenery
    assert around is not None
    values = {
        **btf.decoder,
        "latents": btf.latents,
        "cloth": Mesh(
            cloth.vertices,
            cloth.triangles,
            cloth.normals,
            cloth.places,
            {"TANGENT": cloth.tangents},
        ),
        "room": Mesh(around.vertices, around.triangles, attributes={"RADIANCE": around.radiance}),
    }
    if btf.ids is not None:
        values["ids"] = btf.ids.astype(_ids_type(btf))
    return values


def _ids_type(btf: CompressedBtf) -> np.dtype[Any]:
    """The smallest integer that numbers the latents."""
    import numpy as np

    return np.min_scalar_type(len(btf.latents) - 1)


def _parameters(btf: CompressedBtf) -> dict[str, Any]:
    return {"alpha": btf.alpha, "height": btf.height, "width": btf.width}


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


def _figures(keys: Mapping[str, str], btf: CompressedBtf, rmse: float) -> list[Figure]:
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
        Figure("RMSE over alpha", rmse, "1", told),
        Figure("Decoder, latents, index list", float(btf.payload_bytes), "byte", size),
        Figure("Texels", float(btf.texels)),
        Figure("Latent vectors", float(len(btf.latents))),
    ]
