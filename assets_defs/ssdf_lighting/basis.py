"""SSDFs made small: `ssdf_basis`."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Any, ClassVar, Literal, NamedTuple

from pydantic import Field

from assets_defs.checks import Check
from assets_defs.settings import Preset, Settings
from assets_defs.sources import Source
from assets_defs.ssdf_lighting.clusters import ClusterSettings
from assets_defs.ssdf_lighting.datasets import (
    basis_dataset,
    decoder_of,
    dense_clusters,
    distance_blocks,
    file_variables,
    pca_variables,
    shared_basis_of,
)
from assets_defs.ssdf_lighting.declaration import SSDF
from assets_defs.ssdf_lighting.meshes import SceneSettings, load_scene
from assets_defs.ssdf_lighting.visibility import VisibilitySettings, check_size
from assets_defs.system import Metadata, Pictures, Progress, Result
from pipelines.ssdf_lighting import figures
from storage.schemas import ssdf_lighting as schemas
from storage.stored_version import StoredVersion

if TYPE_CHECKING:
    import xarray as xr

    from pipelines.ssdf_lighting.compression.decoder import Decoder


class BasisSettings(Settings):
    """How small, or how exact."""

    coding: Literal["compact", "bits", "paper"] = Field(
        "compact",
        description="A shared basis in few bits, or bits of visibility from which distances are "
        "rebuilt when they are loaded, or the paper's vectors and weights",
    )
    rmse: float = Field(
        0.006, gt=0.0, le=1.0, description="Compact: error, radians weighted by solid angle"
    )
    file_budget: int | None = Field(
        None, ge=1000, description="Compact: bytes of the file instead; the least error for them"
    )
    values: int = Field(48, ge=1, le=65_535, description="Paper: singular values a cluster")
    contribution: float | None = Field(
        None, gt=0.0, le=1.0, description="Paper: share of the singular values' sum instead"
    )

    sizes: ClassVar[Mapping[Preset, Mapping[str, object]]] = {
        "test": {"rmse": 0.018},
        "paper": {"coding": "paper"},
    }


@SSDF.before_work
def check_compression(sources: Mapping[str, Source], settings: Mapping[str, Settings]) -> None:
    """Raises ValueError for sizes and bytes that cannot be, before any ray is traced: more values
    than rows, an error below that of the shared basis."""
    if "scene" not in sources or "ssdf_basis" not in settings:
        return
    size, rays = settings["scene_mesh"], settings["visibility"]
    clustering, basis = settings["triangle_clusters"], settings["ssdf_basis"]
    assert isinstance(size, SceneSettings)
    assert isinstance(rays, VisibilitySettings)
    assert isinstance(clustering, ClusterSettings)
    assert isinstance(basis, BasisSettings)
    scene, name = load_scene(sources["scene"], size), sources["scene"].name
    vertices = len(scene.vertices)
    check_size(name, vertices, rays)
    if basis.coding == "paper":
        rows = min(vertices, rays.directions)
        if basis.contribution is None and basis.values > rows:
            raise ValueError(
                f"{name}: values is {basis.values}; expected at most {rows}, the rows or columns "
                "of the matrix."
            )
    elif (
        basis.coding == "compact"
        and basis.file_budget is None
        and basis.rmse < 1.5 * clustering.shared_error
    ):
        raise ValueError(
            f"{name}: rmse is {basis.rmse:g}; expected at least 1.5 times shared_error, "
            f"{clustering.shared_error:g}, for the shared basis leaves that out already."
        )


def _sampled_rmse(version: StoredVersion) -> float:
    """Of sampled vertices, decoded here, over that of the same vertices when it was made."""
    import numpy as np

    basis, matrix = version.dataset, version.input("ssdf_matrix")["distances"]
    rows, n = figures.sampled_rows(len(matrix), 384), math.isqrt(matrix.shape[1])
    found = figures.weighted_rmse(decoder_of(basis).distances_in(rows, n), matrix[rows].values)
    stored = basis["vertex_rmse"].values[rows].astype(np.float64)
    return float(found / max(np.sqrt((stored**2).mean()), 1e-12))


def _rmse(version: StoredVersion) -> float:
    return float(version.dataset["rmse"])


def _over_budget(version: StoredVersion) -> float | None:
    """What was reached over what was asked for: bytes, or error. Of bits nothing is asked for."""
    settings, basis = version.record["settings"], version.dataset
    if settings["coding"] == "paper":
        return float(basis["bytes_memory"] / basis["bytes_raw"])
    if settings["coding"] == "bits":
        return None
    if settings["file_budget"] is not None:
        return float(basis["bytes_file"] / settings["file_budget"])
    return float(basis["rmse"] / settings["rmse"])


def _byte_share(version: StoredVersion) -> float:
    return float(version.dataset["bytes_memory"] / version.dataset["bytes_raw"])


def _wrong_visibility(version: StoredVersion) -> float:
    return float(version.dataset["wrong_visibility"])


def _seam_ratio(version: StoredVersion) -> float:
    """Steps of the error across borders of clusters over those beside them, some directions."""
    decoder, blocks = decoder_of(version.dataset), distance_blocks(version.input("ssdf_matrix"))
    errors = figures.errors_along_axes(blocks, decoder.distances_along)
    triangles = version.input("scene_mesh")["triangles"].values
    return figures.seam_ratio(errors, triangles, decoder.resident.cluster)


def _basis_pictures(dataset: xr.Dataset) -> Pictures:
    from pipelines.ssdf_lighting.drawing.pictures import error_histogram

    return {"error": error_histogram(dataset["vertex_rmse"].values, float(dataset["rmse"]))}


@SSDF.asset(
    schemas.SSDF_BASIS,
    by=("scene",),
    settings=BasisSettings,
    inputs=("scene_mesh", "ssdf_matrix", "triangle_clusters"),
    pictures=_basis_pictures,
    checks=(
        Check(
            "over_budget",
            "Error over the error asked for, or bytes over the bytes asked for; of the paper's "
            "form, bytes over raw bytes.",
            _over_budget,
            at_most=1.1,
        ),
        Check(
            "sampled_rmse",
            "Error of sampled vertices, decoded anew, over that when they were compressed.",
            _sampled_rmse,
            at_least=0.99,
            at_most=1.01,
        ),
        Check("rmse", "Error in memory, rad.", _rmse, at_most=0.1, change=0.001),
        Check(
            "byte_share",
            "Bytes resident while drawn over raw bytes.",
            _byte_share,
            at_most=0.5,
            change=0.002,
        ),
        Check(
            "wrong_visibility",
            "Share of the sky above the vertices in which the sign of d is wrong.",
            _wrong_visibility,
            at_most=0.03,
            change=0.001,
        ),
        Check(
            "seam_ratio",
            "Steps of the error across borders of clusters, over those beside: 1 is invisible.",
            _seam_ratio,
            at_most=2.0,
            change=0.1,
        ),
    ),
)
def ssdf_basis(
    settings: BasisSettings,
    progress: Progress,
    scene_mesh: xr.Dataset,
    ssdf_matrix: xr.Dataset,
    triangle_clusters: xr.Dataset,
) -> Result:
    """Compress the SSDFs, and measure what that does to them."""
    if settings.coding == "paper":
        coded = _papers_form(settings, progress, scene_mesh, ssdf_matrix, triangle_clusters)
    elif settings.coding == "bits":
        coded = _bits_form(scene_mesh, ssdf_matrix, triangle_clusters)
    else:
        coded = _compact_form(settings, triangle_clusters)
    progress(0.8)
    raw = ssdf_matrix["distances"].size * 4
    decode = partial(coded.decoder.distances_in, n=math.isqrt(ssdf_matrix.sizes["direction"]))
    blocks, normals = distance_blocks(ssdf_matrix), scene_mesh["normals"].values
    errors = figures.compression_errors(blocks, decode, normals)
    counts = {"raw": raw, "file": coded.file_bytes, "memory": coded.memory_bytes}
    return basis_dataset(coded.variables, counts, errors), {
        **coded.shown,
        "bytes raw": raw,
        "bytes of the file": coded.file_bytes,
        "bytes in memory": coded.memory_bytes,
        "RMSE, rad": errors.rmse,
        "wrong visibility": errors.wrong_visibility,
    }


class _Coded(NamedTuple):
    """SSDFs in one of the forms: what is stored of it, what decodes it, what the web UI shows."""

    variables: Mapping[str, Any]
    decoder: Decoder
    file_bytes: int
    memory_bytes: int
    shown: Metadata


def _papers_form(
    settings: BasisSettings,
    progress: Progress,
    scene_mesh: xr.Dataset,
    ssdf_matrix: xr.Dataset,
    triangle_clusters: xr.Dataset,
) -> _Coded:
    from pipelines.ssdf_lighting.compression.clustered_pca import clustered_pca
    from pipelines.ssdf_lighting.compression.decoder import Decoder

    matrix = ssdf_matrix["distances"]
    pca = clustered_pca(
        lambda rows: matrix[rows].values,
        scene_mesh["triangles"].values,
        triangle_clusters["cluster"].values,
        values=settings.values if settings.contribution is None else None,
        contribution=settings.contribution,
        progress=lambda fraction: progress(0.8 * fraction),
    )
    decoder = Decoder.of_pca(pca, len(matrix))
    shown = {"cumulative error": float(pca.relative_error.sum())}
    return _Coded(pca_variables(pca), decoder, pca.nbytes, decoder.resident_bytes, shown)


def _compact_form(settings: BasisSettings, triangle_clusters: xr.Dataset) -> _Coded:
    from pipelines.ssdf_lighting.compression import compact
    from pipelines.ssdf_lighting.compression.compact_file import to_bytes
    from pipelines.ssdf_lighting.compression.decoder import Decoder

    basis, cluster = shared_basis_of(triangle_clusters), dense_clusters(triangle_clusters)
    if settings.file_budget is None:
        codes = compact.quantise_to_rmse(basis, cluster, settings.rmse)
    else:
        codes = compact.quantise_to_bytes(
            basis, cluster, lambda tried: len(to_bytes(tried)), settings.file_budget
        )
    file = to_bytes(codes)
    shown = {"vectors": len(codes.level), "shared vectors": len(codes.shared)}
    decoder = Decoder.of_file(file)
    return _Coded(file_variables(file), decoder, len(file), decoder.resident_bytes, shown)


def _bits_form(
    scene_mesh: xr.Dataset, ssdf_matrix: xr.Dataset, triangle_clusters: xr.Dataset
) -> _Coded:
    import numpy as np

    from pipelines.ssdf_lighting.compression.bits_file import CodedBits, bits_to_bytes
    from pipelines.ssdf_lighting.compression.decoder import Decoder

    # In the matrix's own directions: of fewer, what sees less than a cell sees nothing.
    seen = np.concatenate([block > 0.0 for _, block in distance_blocks(ssdf_matrix)])
    bits = CodedBits(seen, dense_clusters(triangle_clusters))
    file = bits_to_bytes(bits, scene_mesh["triangles"].values)
    decoder = Decoder.of_file(file)
    shown = {"visible share": float(seen.mean())}
    return _Coded(file_variables(file), decoder, len(file), decoder.resident_bytes, shown)
