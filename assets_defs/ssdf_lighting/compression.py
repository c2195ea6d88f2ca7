"""SSDFs made small: `triangle_clusters`, `ssdf_basis`."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, ClassVar, Literal

from pydantic import Field

from assets_defs.checks import Check
from assets_defs.settings import Preset, Settings
from assets_defs.sources import Source
from assets_defs.ssdf_lighting.declaration import SSDF
from assets_defs.system import Metadata
from storage.schemas import ssdf_lighting as schemas
from storage.stored_version import StoredVersion

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr
    from numpy.typing import NDArray

    from pipelines.ssdf_lighting.compression.compact import SharedBasis
    from pipelines.ssdf_lighting.compression.decoding import Decoder

    Result = tuple[xr.Dataset, Metadata]
    Pictures = dict[str, NDArray[np.uint8]]

_ROWS = 1024
"""Vertices whose distances are in memory together: 16 MB along 4096 directions."""


def distance_blocks(
    ssdf_matrix: xr.Dataset,
) -> Iterator[tuple[NDArray[np.int64], NDArray[np.float32]]]:
    """Vertex numbers and distances of the matrix, block by block."""
    import numpy as np

    distances = ssdf_matrix["distances"]
    for first in range(0, len(distances), _ROWS):
        block = distances[first : first + _ROWS].values
        yield np.arange(first, first + len(block)), block


# ---- triangle_clusters -----------------------------------------------------------------------


class ClusterSettings(Settings):
    """How triangles are put together."""

    clusters: int = Field(256, ge=1, le=65_535, description="Clusters of triangles")
    space: Literal["distances", "positions"] = Field(
        "distances",
        description="Triangles are alike in their SSDFs, or, as in the paper, near each other",
    )
    shared_error: float = Field(
        0.003, gt=0.0, le=0.1, description="Error of the shared basis alone, rad"
    )
    cluster_seed: int = Field(0, ge=0, description="Seed of k-means++")

    sizes: ClassVar[Mapping[Preset, Mapping[str, object]]] = {
        "test": {"clusters": 24, "shared_error": 0.006},
        "paper": {"clusters": 64, "space": "positions"},
    }


def shared_basis_of(triangle_clusters: xr.Dataset) -> SharedBasis:
    """The shared basis that a `triangle_clusters` dataset holds."""
    from pipelines.ssdf_lighting.compression.compact import SharedBasis

    return SharedBasis(
        triangle_clusters["shared"].values,
        triangle_clusters["sigma"].values,
        triangle_clusters["coordinates"].values,
        float(triangle_clusters["lost"]),
    )


def _unused(checked: StoredVersion) -> float:
    """Share of the cluster numbers up to the largest that have no triangle."""
    import numpy as np

    cluster = checked.dataset["cluster"].values
    if cluster.min() < 0:
        return 1.0
    return float((np.bincount(cluster) == 0).mean())


def _compactness(checked: StoredVersion) -> float:
    from pipelines.ssdf_lighting.compression.triangle_clusters import (
        leading_coordinates,
        spread_inside,
    )

    dataset, mesh = checked.dataset, checked.input("scene_mesh")
    if checked.record["settings"]["space"] == "positions":
        features = mesh["vertices"].values
    else:
        features = leading_coordinates(dataset["coordinates"].values)
    return spread_inside(features, mesh["triangles"].values, dataset["cluster"].values)


def _basis_error(checked: StoredVersion) -> float:
    """Error of the shared basis on sampled vertices, over the error it was made for."""
    import numpy as np

    from pipelines.ssdf_lighting.distances.weighted_sphere import root_weights
    from pipelines.ssdf_lighting.figures import sampled_rows

    dataset, matrix = checked.dataset, checked.input("ssdf_matrix")["distances"]
    rows = sampled_rows(len(matrix), 512)
    weighted = matrix[rows].values * root_weights(matrix.shape[1])
    found = dataset["coordinates"].values[rows] @ dataset["shared"].values.T
    error = float(np.sqrt(((weighted - found).astype(np.float64) ** 2).mean()))
    return error / checked.record["settings"]["shared_error"]


def _cluster_pictures(dataset: xr.Dataset) -> Pictures:
    from pipelines.ssdf_lighting.drawing.pictures import basis_picture, sizes_picture

    return {
        "shared-basis": basis_picture(dataset["shared"].values.T[:24]),
        "cluster-sizes": sizes_picture(dataset["vertex_cluster"].values),
    }


@SSDF.asset(
    schemas.TRIANGLE_CLUSTERS,
    by=("scene",),
    settings=ClusterSettings,
    inputs=("scene_mesh", "ssdf_matrix"),
    pictures=_cluster_pictures,
    checks=(
        Check("unused", "Share of the cluster numbers without a triangle.", _unused, at_most=0.0),
        Check(
            "compactness",
            "Spread of what was clustered inside the clusters, over that of everything.",
            _compactness,
            at_most=0.9,
            change=0.02,
        ),
        Check(
            "basis_error",
            "Error of the shared basis on sampled vertices, over the error it was made for.",
            _basis_error,
            at_most=2.0,
        ),
    ),
)
def triangle_clusters(
    settings: ClusterSettings,
    progress: Callable[[float], None],
    scene_mesh: xr.Dataset,
    ssdf_matrix: xr.Dataset,
) -> Result:
    """Find the scene's own basis, and cluster the triangles in it or in space."""
    import numpy as np
    import xarray as xr

    from pipelines.lowrank import right_singular_vectors
    from pipelines.ssdf_lighting.compression.triangle_clusters import (
        clusters_by_distance,
        clusters_by_position,
    )
    from pipelines.ssdf_lighting.distances.weighted_sphere import root_weights, weighted_gram

    entries = ssdf_matrix["distances"].size
    vertices, triangles = scene_mesh["vertices"].values, scene_mesh["triangles"].values

    def counted(fraction: float) -> Iterator[NDArray[np.float32]]:
        for numbers, block in distance_blocks(ssdf_matrix):
            yield block
            progress(fraction * (numbers[-1] + 1) / len(vertices))

    found = right_singular_vectors(weighted_gram(counted(0.6)), settings.shared_error**2 * entries)
    coordinates = np.concatenate(
        [
            (block * root_weights(block.shape[1])) @ found.vectors
            for _, block in distance_blocks(ssdf_matrix)
        ]
    )
    progress(0.8)
    if settings.space == "positions":
        made = clusters_by_position(vertices, triangles, settings.clusters, settings.cluster_seed)
    else:
        made = clusters_by_distance(
            coordinates, triangles, settings.clusters, settings.cluster_seed
        )
    dataset = xr.Dataset(
        {
            "cluster": (("triangle",), made.triangle),
            "vertex_cluster": (("vertex",), made.vertex),
            "shared": (("direction", "component"), found.vectors),
            "sigma": (("component",), found.singular_values),
            "coordinates": (("vertex", "component"), coordinates),
            "lost": ((), found.lost),
        }
    )
    return dataset, {"components": len(found.singular_values)}


# ---- ssdf_basis ------------------------------------------------------------------------------


class BasisSettings(Settings):
    """How small, or how exact."""

    coding: Literal["compact", "paper"] = Field(
        "compact", description="A shared basis in few bits, or the paper's vectors and weights"
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
        "test": {"rmse": 0.02},
        "paper": {"coding": "paper"},
    }


@SSDF.before_work
def check_compression(sources: Mapping[str, Source], settings: Mapping[str, Settings]) -> None:
    """Raises ValueError for more clusters than triangles, more values than rows, and an error
    below that of the shared basis."""
    if "scene" not in sources or "ssdf_basis" not in settings:
        return
    from assets_defs.ssdf_lighting.meshes import check_size, counted

    clustering, basis = settings["triangle_clusters"], settings["ssdf_basis"]
    vertices, triangles = counted(sources["scene"], settings["scene_mesh"])
    name = sources["scene"].name
    directions = check_size(name, vertices, settings["visibility"])
    assert isinstance(clustering, ClusterSettings)
    assert isinstance(basis, BasisSettings)
    if clustering.clusters > triangles:
        raise ValueError(
            f"{name}: clusters is {clustering.clusters}; expected at most {triangles}, the number "
            "of triangles."
        )
    if basis.coding == "paper":
        rows = min(vertices, directions)
        if basis.contribution is None and basis.values > rows:
            raise ValueError(
                f"{name}: values is {basis.values}; expected at most {rows}, the rows or columns "
                "of the matrix."
            )
    elif basis.file_budget is None and basis.rmse < 1.5 * clustering.shared_error:
        raise ValueError(
            f"{name}: rmse is {basis.rmse:g}; expected at least 1.5 times shared_error, "
            f"{clustering.shared_error:g}, for the shared basis leaves that out already."
        )


def decoder_of_basis(ssdf_basis: xr.Dataset, vertices: int) -> Decoder:
    """Decodes what an `ssdf_basis` dataset holds, in either form."""
    from pipelines.ssdf_lighting.compression.clustered_pca import ClusteredPca, decoder_of_pca
    from pipelines.ssdf_lighting.compression.compact_file import from_bytes
    from pipelines.ssdf_lighting.compression.compact_memory import packed
    from pipelines.ssdf_lighting.compression.decoding import decoder_of

    if "file" in ssdf_basis:
        return decoder_of(packed(from_bytes(ssdf_basis["file"].values.tobytes())))
    parts = ("vectors", "first", "row_vertex", "row_first", "weights", "relative_error")
    pca = ClusteredPca(*(ssdf_basis[name].values for name in parts))
    return decoder_of_pca(pca, vertices)


def _sample(
    checked: StoredVersion,
) -> tuple[NDArray[np.int64], NDArray[np.float32], NDArray[np.float32]]:
    """Vertex numbers, distances found and distances wanted of some vertices."""
    from pipelines.ssdf_lighting.compression.decoding import decoded_rows
    from pipelines.ssdf_lighting.figures import sampled_rows

    matrix = checked.input("ssdf_matrix")["distances"]
    rows = sampled_rows(len(matrix), 384)
    decoder = decoder_of_basis(checked.dataset, len(matrix))
    return rows, decoded_rows(decoder, rows), matrix[rows].values


def _sampled_rmse(checked: StoredVersion) -> float:
    """Of sampled vertices, decoded here, over that of the same vertices when it was made."""
    import numpy as np

    from pipelines.ssdf_lighting.distances.weighted_sphere import root_weights

    rows, found, wanted = _sample(checked)
    weighted = (found - wanted) * root_weights(wanted.shape[1])
    stored = checked.dataset["vertex_rmse"].values[rows].astype(np.float64)
    rmse = np.sqrt((weighted.astype(np.float64) ** 2).mean())
    return float(rmse / max(np.sqrt((stored**2).mean()), 1e-12))


def _rmse(checked: StoredVersion) -> float:
    return float(checked.dataset["rmse"])


def _over_budget(checked: StoredVersion) -> float:
    """What was asked for over what was reached: bytes, or error."""
    settings, dataset = checked.record["settings"], checked.dataset
    if settings["coding"] == "paper":
        return float(dataset["bytes_memory"] / dataset["bytes_raw"])
    if settings["file_budget"] is not None:
        return float(dataset["bytes_file"] / settings["file_budget"])
    return float(dataset["rmse"] / settings["rmse"])


def _byte_share(checked: StoredVersion) -> float:
    return float(checked.dataset["bytes_memory"] / checked.dataset["bytes_raw"])


def _wrong_visibility(checked: StoredVersion) -> float:
    return float(checked.dataset["wrong_visibility"])


def _border_step(checked: StoredVersion) -> float:
    """Steps of the error across borders of clusters over those inside, some directions."""
    import numpy as np

    from pipelines.ssdf_lighting.compression.decoding import distances_along, matrix_along
    from pipelines.ssdf_lighting.figures import border_step

    matrix, mesh = checked.input("ssdf_matrix")["distances"], checked.input("scene_mesh")
    decoder = decoder_of_basis(checked.dataset, len(matrix))
    axes = np.random.default_rng(0).normal(size=(1, 12, 3)).astype(np.float32)
    axes /= np.linalg.norm(axes, axis=2, keepdims=True)
    errors = np.empty((len(matrix), axes.shape[1]), np.float32)
    for rows, block in distance_blocks(checked.input("ssdf_matrix")):
        ways = np.repeat(axes, len(block), axis=0)
        found = distances_along(decoder, rows, ways)
        errors[rows] = found - matrix_along(block, np.arange(len(block)), ways)
    return border_step(errors, mesh["triangles"].values, decoder.cluster)


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
            "Bytes in memory over raw bytes.",
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
            "border_step",
            "Steps of the error across borders of clusters, over those inside.",
            _border_step,
            at_most=4.0,
            change=0.1,
        ),
    ),
)
def ssdf_basis(
    settings: BasisSettings,
    progress: Callable[[float], None],
    scene_mesh: xr.Dataset,
    ssdf_matrix: xr.Dataset,
    triangle_clusters: xr.Dataset,
) -> Result:
    """Compress the SSDFs, and measure what that does to them."""
    import numpy as np
    import xarray as xr

    from pipelines.ssdf_lighting.compression.clustered_pca import clustered_pca
    from pipelines.ssdf_lighting.compression.compact import searched, searched_for_bytes
    from pipelines.ssdf_lighting.compression.compact_file import to_bytes
    from pipelines.ssdf_lighting.compression.compact_memory import packed
    from pipelines.ssdf_lighting.compression.decoding import decoded_rows
    from pipelines.ssdf_lighting.figures import compression_error

    matrix = ssdf_matrix["distances"]
    if settings.coding == "paper":
        pca = clustered_pca(
            lambda rows: matrix[rows].values,
            scene_mesh["triangles"].values,
            triangle_clusters["cluster"].values,
            values=settings.values if settings.contribution is None else None,
            contribution=settings.contribution,
            progress=lambda fraction: progress(0.8 * fraction),
        )
        variables = {
            "vectors": (("value", "direction"), pca.vectors),
            "first": (("cluster_end",), pca.first),
            "row_vertex": (("row",), pca.row_vertex),
            "row_first": (("cluster_end",), pca.row_first),
            "weights": (("weight",), pca.weights),
            "relative_error": (("cluster",), pca.relative_error),
        }
        in_file = in_memory = pca.nbytes
        shown = {"cumulative error": float(pca.relative_error.sum())}
    else:
        # Cluster numbers of vertices without gaps: a cluster of triangles may have no vertex.
        _, cluster = np.unique(triangle_clusters["vertex_cluster"].values, return_inverse=True)
        basis = shared_basis_of(triangle_clusters)
        if settings.file_budget is None:
            compact = searched(basis, cluster.astype(np.int32), settings.rmse)
        else:
            compact = searched_for_bytes(
                basis,
                cluster.astype(np.int32),
                lambda tried: len(to_bytes(tried)),
                settings.file_budget,
            )
        file = np.frombuffer(to_bytes(compact), np.uint8)
        variables = {"file": (("byte",), file)}
        in_file, in_memory = len(file), packed(compact).nbytes
        shown = {"vectors": len(compact.level), "shared vectors": len(compact.shared)}
    progress(0.8)
    decoder = decoder_of_basis(xr.Dataset(variables), len(matrix))
    error = compression_error(
        distance_blocks(ssdf_matrix),
        lambda rows: decoded_rows(decoder, rows),
        scene_mesh["normals"].values,
    )
    dataset = xr.Dataset(
        {
            **variables,
            "bytes_raw": ((), np.int64(matrix.size * 4)),
            "bytes_file": ((), np.int64(in_file)),
            "bytes_memory": ((), np.int64(in_memory)),
            "rmse": ((), error.rmse),
            "wrong_visibility": ((), error.wrong_visibility),
            "vertex_rmse": (("vertex",), error.vertex_rmse),
        }
    )
    return dataset, {
        **shown,
        "bytes raw": matrix.size * 4,
        "bytes of the file": in_file,
        "bytes in memory": in_memory,
        "RMSE, rad": error.rmse,
        "wrong visibility": error.wrong_visibility,
    }
