"""The compressed BTF against what was measured: `restored_images`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from assets_defs.checks import Check
from assets_defs.neural_btf.datasets import (
    abrdf_reader,
    compressed_btf_of,
    pairs_of,
    restored_images_dataset,
)
from assets_defs.neural_btf.declaration import BTF, NONE
from assets_defs.settings import Settings
from assets_defs.system import Pictures, Progress, Result
from storage.errors import NoVersionError
from storage.schemas import neural_btf as schemas
from storage.stored_version import StoredVersion
from storage.versions import Slot

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr
    from numpy.typing import NDArray

    from pipelines.light.directions import Pairs

_BLOCK_BYTES = 96 << 20


class RestoreSettings(Settings):
    """Nothing to choose: figure 7's pairs, and the errors of all photographs."""


def _restored_pictures(dataset: xr.Dataset) -> Pictures:
    from pipelines.light.directions import Pairs
    from pipelines.neural_btf.pictures import error_picture, restored_picture

    shown = Pairs(dataset["pair_light"].values, dataset["pair_view"].values)
    return {
        "restored": restored_picture(dataset["original"].values, dataset["restored"].values, shown),
        "errors": error_picture(
            dataset["rmse_texel"].values,
            dataset["rmse_image"].values,
            Pairs(dataset["light"].values, dataset["view"].values),
        ),
    }


def _stored(name: str) -> Callable[[StoredVersion], float | None]:
    """The figure of this name; None where it does not apply to the photographs."""

    def figure(version: StoredVersion) -> float | None:
        return float(version.dataset[name]) if name in version.dataset else None

    return figure


def _over_null(name: str) -> Callable[[StoredVersion], float]:
    """The figure of this name over that of mean colours."""
    return lambda version: float(version.dataset[name]) / float(version.dataset[f"{name}_null"])


def _rmse_over_none(version: StoredVersion) -> float | None:
    """Against the same material's version without clusters, if it was made alike."""
    clusters, material = version.slot.partition.split(".", 1)
    if clusters == NONE:
        return None
    try:
        without = _made_of(version, f"{NONE}.{material}")
        slot = Slot(BTF.name, "restored_images", f"{NONE}.{material}")
        rmse_without = float(version.store.open(slot)["rmse"])
        own = _made_of(version, version.slot.partition)
    except NoVersionError:
        return None
    return float(version.dataset["rmse"]) / rmse_without if own == without else None


def _made_of(version: StoredVersion, partition: str) -> tuple[Any, str]:
    """Settings and ABRDFs (their content) that a partition's current network was trained with."""
    record = version.store.record(Slot(BTF.name, "neural_btf", partition))
    (content,) = (i["content"] for i in record["inputs"] if i["asset"] == "abrdf_matrix")
    return record["settings"], content


@BTF.asset(
    schemas.RESTORED_IMAGES,
    by=("material", "clusters"),
    settings=RestoreSettings,
    inputs=("btf_images", "abrdf_matrix", "compressed_btf"),
    pictures=_restored_pictures,
    checks=(
        Check(
            "rmse",
            "RMSE of all photographs, values over alpha: its step is judged, not its size.",
            _stored("rmse"),
            at_most=1.0,
            change=0.002,
        ),
        Check(
            "rmse_over_null",
            "RMSE over that of every photograph's mean colour, which knows nothing of texels.",
            _stored("rmse_over_null"),
            at_most=0.8,
            change=0.02,
        ),
        Check(
            "rmse_over_none",
            "RMSE over that of the same material without clusters.",
            _rmse_over_none,
            at_most=3.0,
            change=0.05,
        ),
        Check(
            "worst_photographs",
            "RMSE of the worst tenth of the photographs over that of mean colours.",
            _over_null("worst_photographs"),
            at_most=0.9,
            change=0.05,
        ),
        Check(
            "worst_texels",
            "RMSE of the worst tenth of the texels over that of mean colours.",
            _over_null("worst_texels"),
            at_most=0.9,
            change=0.05,
        ),
        Check(
            "grazing_detail",
            "Share of gradients kept and right at views of 60 degrees and more; flat colours: 0.",
            _stored("grazing_detail"),
            at_least=0.1,
            change=0.05,
        ),
    ),
)
def restored_images(
    settings: RestoreSettings,
    progress: Progress,
    btf_images: xr.Dataset,
    abrdf_matrix: xr.Dataset,
    compressed_btf: xr.Dataset,
) -> Result:
    """Restore figure 7's photographs, and compare all of them with what was measured."""
    from pipelines.neural_btf.pictures import PAPER_PAIRS, nearest_images
    from pipelines.neural_btf.restoration import restoration_errors

    stored, pairs = compressed_btf_of(compressed_btf), pairs_of(btf_images)
    block = max(1, _BLOCK_BYTES // (len(pairs.light) * 3 * 4))
    errors = restoration_errors(
        stored, abrdf_reader(abrdf_matrix), pairs, block=block, progress=progress
    )
    shown = nearest_images(pairs, PAPER_PAIRS)
    rows = _error_rows(pairs, errors.of_image, [*shown, int(errors.of_image.argmax())])
    return restored_images_dataset(stored, errors, btf_images, shown), {
        "RMSE over alpha": errors.rmse,
        "RMSE over that of mean colours": errors.quality["rmse_over_null"],
        "FLIP of 24 photographs": errors.quality["flip"],
        "pairs shown, and the worst": rows,
    }


def _error_rows(
    pairs: Pairs, of_image: NDArray[np.float64], numbers: Sequence[int]
) -> list[dict[str, Any]]:
    """What the web UI's table says of the photographs with these numbers."""
    import numpy as np

    return [
        {
            "image": int(number),
            "view theta": float(np.degrees(pairs.view[number, 0])),
            "view phi": float(np.degrees(pairs.view[number, 1])),
            "light theta": float(np.degrees(pairs.light[number, 0])),
            "light phi": float(np.degrees(pairs.light[number, 1])),
            "RMSE": float(of_image[number]),
        }
        for number in numbers
    ]
