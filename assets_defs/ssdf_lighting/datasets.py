"""Stored datasets of this system and the objects of `pipelines`, in both directions."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from assets_defs.ssdf_lighting.texture_variables import (
    texture_variables,
    textures_of,
    tint_variable,
)
from storage.stored_version import StoredVersion

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr
    from numpy.typing import NDArray

    from pipelines.ssdf_lighting.compression.clustered_pca import ClusteredPca
    from pipelines.ssdf_lighting.compression.decoder import Decoder
    from pipelines.ssdf_lighting.compression.shared_basis import SharedBasis
    from pipelines.ssdf_lighting.compression.triangle_clusters import Clusters
    from pipelines.ssdf_lighting.distances.visibility import RayOrigins, SceneVisibility
    from pipelines.ssdf_lighting.drawing.frames import RelitFrames
    from pipelines.ssdf_lighting.figures import CompressionErrors
    from pipelines.ssdf_lighting.light.environment_fit import Fit
    from pipelines.ssdf_lighting.light.interreflection import BounceFactors
    from pipelines.ssdf_lighting.light.spherical_gaussians import Lights
    from pipelines.ssdf_lighting.scene import Scene

_ROWS = 1024
"""Vertices whose distances are in memory together: 16 MB along 4096 directions."""
_PCA = {
    "vectors": ("value", "direction"),
    "first": ("cluster_end",),
    "row_vertex": ("row",),
    "row_first": ("cluster_end",),
    "weights": ("weight",),
    "relative_error": ("cluster",),
}
"""Variables of the paper's form, by the names that its fields have."""
_BOUNCE = {
    "codes": ("vertex", "factor"),
    "steps": ("factor",),
    "vectors": ("factor", "patch"),
    "between": ("patch", "factor"),
    "albedo": ("patch", "channel"),
    "samples": ("patch", "sample"),
}
"""Variables of form factors, in the order of their fields."""


# ---- scene_mesh ------------------------------------------------------------------------------


def scene_dataset(scene: Scene, name: str) -> xr.Dataset:
    """`scene_mesh` of a scene that people know by this name."""
    import xarray as xr

    return xr.Dataset(
        {
            "vertices": (("vertex", "axis"), scene.vertices),
            "normals": (("vertex", "axis"), scene.normals),
            "triangles": (("triangle", "corner"), scene.triangles),
            "part": (("triangle",), scene.part),
            "albedo": (("material", "channel"), scene.materials.albedo),
            "specular": (("material",), scene.materials.specular),
            "roughness": (("material",), scene.materials.roughness),
            **tint_variable(scene.materials),
            **({} if scene.textures is None else texture_variables(scene.textures)),
            "middle": (("axis",), scene.middle),
            "scale": ((), scene.scale),
        },
        attrs={"name": name, "notes": list(scene.notes)},
    )


def scene_of(scene_mesh: xr.Dataset) -> Scene:
    """The scene that a `scene_mesh` dataset holds."""
    from pipelines.ssdf_lighting.light.microfacets import Materials
    from pipelines.ssdf_lighting.scene import Scene

    return Scene(
        scene_mesh["vertices"].values,
        scene_mesh["triangles"].values,
        scene_mesh["normals"].values,
        scene_mesh["part"].values,
        Materials(
            scene_mesh["albedo"].values,
            scene_mesh["specular"].values,
            scene_mesh["roughness"].values,
            scene_mesh["tint"].values if "tint" in scene_mesh else None,
        ),
        scene_mesh["middle"].values,
        float(scene_mesh["scale"]),
        tuple(scene_mesh.attrs["notes"]),
        textures_of(scene_mesh) if "uvs" in scene_mesh else None,
    )


# ---- visibility, ssdf_matrix -----------------------------------------------------------------


def visibility_dataset(found: SceneVisibility, n: int) -> xr.Dataset:
    """`visibility` in n x n directions."""
    import numpy as np
    import xarray as xr

    from pipelines.ssdf_lighting.distances.octahedral import solid_angles, texel_directions

    return xr.Dataset(
        {
            "visible": (("vertex", "byte"), found.visible),
            "origin": (("vertex", "axis"), found.origins.points),
            "sealed": (("vertex",), found.origins.sealed),
            "stored": (("vertex",), found.stored.astype(np.int32)),
            "direction": (("direction", "axis"), texel_directions(n)),
            "solid_angle": (("direction",), solid_angles(n)),
        }
    )


def visible_of(visibility: xr.Dataset) -> NDArray[np.bool_]:
    """Whether each vertex sees the sky in each direction (vertices, directions)."""
    from pipelines.ssdf_lighting.distances.visibility import unpacked

    return unpacked(visibility["visible"].values, visibility.sizes["direction"])


def ray_origins_of(visibility: xr.Dataset) -> RayOrigins:
    """Where the rays of a `visibility` dataset started."""
    from pipelines.ssdf_lighting.distances.visibility import RayOrigins

    return RayOrigins(visibility["origin"].values, visibility["sealed"].values)


def distance_blocks(
    ssdf_matrix: xr.Dataset,
) -> Iterator[tuple[NDArray[np.int64], NDArray[np.float32]]]:
    """Vertex numbers and distances of the matrix, block by block, in order."""
    import numpy as np

    distances = ssdf_matrix["distances"]
    for first in range(0, len(distances), _ROWS):
        block = distances[first : first + _ROWS].values
        yield np.arange(first, first + len(block)), block


def matrix_distances_along(
    ssdf_matrix: xr.Dataset, vertices: NDArray[np.int64], axes: NDArray[np.float32]
) -> NDArray[np.float32]:
    """d (P, L) of the stored matrix along axes (P, L, 3), block by block; ``vertices`` (P,) are
    ascending."""
    import numpy as np

    from pipelines.ssdf_lighting.compression.lookup import matrix_along

    found = np.empty(axes.shape[:2], np.float32)
    for rows, block in distance_blocks(ssdf_matrix):
        inside = np.flatnonzero((vertices >= rows[0]) & (vertices <= rows[-1]))
        found[inside] = matrix_along(block, vertices[inside] - rows[0], axes[inside])
    return found


# ---- triangle_clusters -----------------------------------------------------------------------


def clusters_dataset(clusters: Clusters, basis: SharedBasis) -> xr.Dataset:
    """`triangle_clusters`, with the basis that they share."""
    import xarray as xr

    return xr.Dataset(
        {
            "cluster": (("triangle",), clusters.triangle),
            "vertex_cluster": (("vertex",), clusters.vertex),
            "shared": (("direction", "component"), basis.vectors),
            "sigma": (("component",), basis.sigma),
            "coordinates": (("vertex", "component"), basis.coordinates),
            "lost": ((), basis.lost),
        }
    )


def clusters_of(triangle_clusters: xr.Dataset) -> Clusters:
    """The clusters that a `triangle_clusters` dataset holds."""
    from pipelines.ssdf_lighting.compression.triangle_clusters import Clusters

    return Clusters(triangle_clusters["cluster"].values, triangle_clusters["vertex_cluster"].values)


def dense_clusters(triangle_clusters: xr.Dataset) -> NDArray[np.int32]:
    """Numbers of vertices' clusters (V,), without gaps: some clusters may have no vertex."""
    import numpy as np

    _, dense = np.unique(triangle_clusters["vertex_cluster"].values, return_inverse=True)
    return dense.astype(np.int32)


def shared_basis_of(triangle_clusters: xr.Dataset) -> SharedBasis:
    """The shared basis that a `triangle_clusters` dataset holds."""
    from pipelines.ssdf_lighting.compression.shared_basis import SharedBasis

    return SharedBasis(
        triangle_clusters["shared"].values,
        triangle_clusters["sigma"].values,
        triangle_clusters["coordinates"].values,
        float(triangle_clusters["lost"]),
    )


# ---- ssdf_basis ------------------------------------------------------------------------------


def file_variables(file: bytes) -> Mapping[str, Any]:
    """Variables of an `ssdf_basis` dataset that is a file."""
    import numpy as np

    return {"file": (("byte",), np.frombuffer(file, np.uint8))}


def pca_variables(pca: ClusteredPca) -> Mapping[str, Any]:
    """Variables of an `ssdf_basis` dataset in the paper's form."""
    return {name: (dims, getattr(pca, name)) for name, dims in _PCA.items()}


def basis_dataset(
    form: Mapping[str, Any], byte_counts: Mapping[str, int], errors: CompressionErrors
) -> xr.Dataset:
    """`ssdf_basis` of a form's variables, with its bytes (raw, file, memory) and errors."""
    import numpy as np
    import xarray as xr

    return xr.Dataset(
        {
            **form,
            **{f"bytes_{name}": ((), np.int64(count)) for name, count in byte_counts.items()},
            "rmse": ((), errors.rmse),
            "wrong_visibility": ((), errors.wrong_visibility),
            "vertex_rmse": (("vertex",), errors.vertex_rmse),
        }
    )


def decoder_of(ssdf_basis: xr.Dataset) -> Decoder:
    """Decodes what an `ssdf_basis` dataset holds, in any form."""
    from pipelines.ssdf_lighting.compression.clustered_pca import ClusteredPca
    from pipelines.ssdf_lighting.compression.decoder import Decoder

    if "file" in ssdf_basis:
        return Decoder.of_file(ssdf_basis["file"].values.tobytes())
    pca = ClusteredPca(*(ssdf_basis[name].values for name in _PCA))
    return Decoder.of_pca(pca, ssdf_basis.sizes["vertex"])


def packed_basis(ssdf_basis: xr.Dataset, triangle_clusters: xr.Dataset) -> xr.Dataset:
    """`ssdf_basis` as a package holds it, for readers that rebuild nothing: instead of bits, the
    compact form with the error that what is rebuilt from them has."""
    from pipelines.ssdf_lighting.compression.compact import quantise_to_rmse
    from pipelines.ssdf_lighting.compression.compact_file import to_bytes
    from pipelines.ssdf_lighting.compression.decoder import holds_bits

    if "file" not in ssdf_basis or not holds_bits(ssdf_basis["file"].values.tobytes()):
        return ssdf_basis
    basis, rmse = shared_basis_of(triangle_clusters), float(ssdf_basis["rmse"])
    codes = quantise_to_rmse(basis, dense_clusters(triangle_clusters), rmse)
    return ssdf_basis.drop_dims("byte").assign(file_variables(to_bytes(codes)))


# ---- bounce_factors --------------------------------------------------------------------------


def bounce_dataset(factors: BounceFactors) -> xr.Dataset:
    """`bounce_factors` of form factors."""
    import xarray as xr

    parts = zip(_BOUNCE.items(), factors, strict=True)
    return xr.Dataset({name: (dims, values) for (name, dims), values in parts})


def bounce_of(bounce_factors: xr.Dataset) -> BounceFactors:
    """The form factors that a `bounce_factors` dataset holds."""
    from pipelines.ssdf_lighting.light.interreflection import BounceFactors

    return BounceFactors(*(bounce_factors[name].values for name in _BOUNCE))


# ---- environment_lights, relit_frames --------------------------------------------------------


def lights_dataset(
    radiance: NDArray[np.floating], fit: Fit, flux_error: float, name: str
) -> xr.Dataset:
    """`environment_lights` of a map (row, column, 3) and of what was fitted to it."""
    import xarray as xr

    return xr.Dataset(
        {
            "radiance": (("row", "column", "channel"), radiance.astype("float32")),
            "axes": (("light", "axis"), fit.lights.axes),
            "sharpness": (("light",), fit.lights.sharpness),
            "amplitudes": (("light", "channel"), fit.lights.amplitudes),
            **{name: ((), error) for name, error in fit.errors._asdict().items()},
            "flux_error": ((), flux_error),
        },
        attrs={"name": name},
    )


def lights_of(environment_lights: xr.Dataset) -> Lights:
    """The lights of an `environment_lights` dataset."""
    from pipelines.ssdf_lighting.light.spherical_gaussians import Lights

    names = ("axes", "sharpness", "amplitudes")
    return Lights(*(environment_lights[name].values for name in names))


def frames_dataset(
    found: RelitFrames, turns: Sequence[float], clusters: NDArray[np.uint8]
) -> xr.Dataset:
    """`relit_frames` at these turns (degrees), with the picture of the clusters."""
    import numpy as np
    import xarray as xr

    pixels = ("y", "x", "channel")
    return xr.Dataset(
        {
            "frames": (("frame", *pixels), found.frames),
            "turn": (("frame",), np.array(turns)),
            "exposure": ((), found.exposure),
            "uncompressed": (pixels, found.uncompressed),
            "direct": (pixels, found.direct),
            "reference": (pixels, found.reference),
            "clusters": (pixels, clusters),
            "covered": (("y", "x"), found.turning.covered),
        }
    )


LOADERS: dict[str, Callable[[StoredVersion], object]] = {
    "scene_mesh": lambda version: scene_of(version.dataset),
    "visibility": lambda version: visible_of(version.dataset),
    "triangle_clusters": lambda version: clusters_of(version.dataset),
    "ssdf_basis": lambda version: decoder_of(version.dataset),
    "bounce_factors": lambda version: bounce_of(version.dataset),
    "environment_lights": lambda version: lights_of(version.dataset),
}
"""What ``tsuya.load`` gives, by asset: the scene, what its vertices see, clusters, the decoder,
form factors, the lights."""
