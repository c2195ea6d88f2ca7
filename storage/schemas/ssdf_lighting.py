"""Datasets of image-based lighting: scenes, visibility, SSDFs and their compressed form, lights."""

from storage.schemas.schema import Schema, Variable

_SYSTEM = "ssdf_lighting"
_PAPER = "section 2"

_TEXTURES = {
    "uvs": Variable(
        ("triangle", "corner", "mapping", "coordinate"),
        "float32",
        "texture",
        "Two texture coordinates of each corner, v from the bottom",
        optional=True,
    ),
    "colours": Variable(
        ("triangle", "corner", "channel"),
        "float32",
        "1",
        "Of the corners, linear, times the base colour",
        optional=True,
    ),
    "varying": Variable(
        ("varying",), "int32", "1", "Row of each material that varies", optional=True
    ),
    "factors": Variable(
        ("varying", "factor"),
        "float64",
        "1",
        "Base colour (3), metalness, F0 of what is no metal (3), roughness (root of m), bend",
        optional=True,
    ),
    "texture_of": Variable(
        ("texture", "place"),
        "int32",
        "1",
        "Row of the varying material, and what it says: 0 colour, 1 surface, 2 normal",
        optional=True,
    ),
    "texture_size": Variable(
        ("texture", "coordinate"), "int32", "texel", "Width and height", optional=True
    ),
    "texture_wrap": Variable(
        ("texture", "coordinate"),
        "int32",
        "1",
        "Outside of [0, 1]: 0 repeated, 1 mirrored, 2 clamped",
        optional=True,
    ),
    "texture_mapping": Variable(
        ("texture",), "int32", "1", "Which of the two texture coordinates", optional=True
    ),
    "texels": Variable(
        ("texel", "channel"),
        "uint8",
        "1",
        "Row by row from the top, one texture after the other: sRGB codes; shares of F0, of the "
        "roughness, of the metalness; normals",
        optional=True,
    ),
}
"""Of scenes with textures or colours of vertices."""

SCENE_MESH = Schema(
    _SYSTEM,
    "scene_mesh",
    1,
    "Surfaces to be lit, repaired, about the origin, in a sphere of radius 1; z is up.",
    {
        "vertices": Variable(("vertex", "axis"), "float64", "scene radius", "Positions, each once"),
        "normals": Variable(("vertex", "axis"), "float64", "1", "Unit normals"),
        "triangles": Variable(
            ("triangle", "corner"), "int32", "1", "Vertex numbers, counter-clockwise from outside"
        ),
        "part": Variable(("triangle",), "int32", "1", "Row of the materials"),
        "albedo": Variable(("material", "channel"), "float64", "1", "Diffuse reflectance, linear"),
        "specular": Variable(
            ("material",), "float64", "1", "Fresnel reflectance at normal incidence; 0 = no gloss"
        ),
        "roughness": Variable(("material",), "float64", "1", "Beckmann's slope m"),
        "tint": Variable(
            ("material", "channel"),
            "float64",
            "1",
            "What the gloss is multiplied by: colours of metals",
            optional=True,
        ),
        **_TEXTURES,
        "middle": Variable(("axis",), "float64", "mesh unit", "Given position of the origin"),
        "scale": Variable((), "float64", "mesh unit", "Given length of the scene's radius"),
    },
)

VISIBILITY = Schema(
    _SYSTEM,
    "visibility",
    1,
    "In which directions each vertex sees the sky.",
    {
        "visible": Variable(
            ("vertex", "byte"),
            "uint8",
            "1",
            "V, one bit a direction, the first direction in a byte's highest bit",
            f"{_PAPER}, V(ω)",
        ),
        "origin": Variable(
            ("vertex", "axis"), "float32", "scene radius", "Where rays start, off the surface"
        ),
        "sealed": Variable(
            ("vertex",), "bool", "1", "Whether other surfaces cover the vertex on all sides"
        ),
        "stored": Variable(
            ("vertex",),
            "int32",
            "1",
            "Vertex whose visibility is stored: itself, or the nearest one that is not buried",
        ),
        "direction": Variable(
            ("direction", "axis"), "float64", "1", "Unit vectors; the octahedral map's texels"
        ),
        "solid_angle": Variable(("direction",), "float64", "sr", "Of each direction's texel"),
    },
)

SSDF_MATRIX = Schema(
    _SYSTEM,
    "ssdf_matrix",
    1,
    "Spherical signed distance functions: how far each direction is from the edge of the sky.",
    {
        "distances": Variable(
            ("vertex", "direction"),
            "float32",
            "rad",
            "d, positive where visible; ±pi where there is no edge",
            f"{_PAPER}, Eq. 1",
        ),
    },
)

TRIANGLE_CLUSTERS = Schema(
    _SYSTEM,
    "triangle_clusters",
    1,
    "Clusters of triangles and vertices, and the basis that all of them share.",
    {
        "cluster": Variable(("triangle",), "int32", "1", "Cluster of each triangle", _PAPER),
        "vertex_cluster": Variable(("vertex",), "int32", "1", "Cluster nearest to each vertex"),
        "shared": Variable(
            ("direction", "component"),
            "float32",
            "1",
            "Strongest right singular vectors of all SSDFs, weighted by solid angle",
        ),
        "sigma": Variable(("component",), "float64", "rad", "Their singular values"),
        "coordinates": Variable(
            ("vertex", "component"), "float32", "rad", "The vertices' SSDFs in that basis"
        ),
        "lost": Variable((), "float64", "rad^2", "Sum of squares that the basis leaves out"),
    },
)

SSDF_BASIS = Schema(
    _SYSTEM,
    "ssdf_basis",
    1,
    "The compressed SSDFs: a file, or the paper's vectors and weights.",
    {
        "file": Variable(
            ("byte",),
            "uint8",
            "1",
            "The compact form, or bits, entropy coded (docs/ssdf_file.md)",
            optional=True,
        ),
        "vectors": Variable(
            ("value", "direction"),
            "float32",
            "1",
            "The paper's: left singular vectors, cluster by cluster",
            f"{_PAPER}, U",
            optional=True,
        ),
        "first": Variable(
            ("cluster_end",), "int64", "1", "Where a cluster's vectors begin", optional=True
        ),
        "row_vertex": Variable(
            ("row",), "int32", "1", "Vertex of each row of weights", optional=True
        ),
        "row_first": Variable(
            ("cluster_end",), "int64", "1", "Where a cluster's rows begin", optional=True
        ),
        "weights": Variable(
            ("weight",), "float32", "rad", "Row by row", f"{_PAPER}, S V", optional=True
        ),
        "relative_error": Variable(
            ("cluster",),
            "float64",
            "1",
            "Norm of what is lost over the norm of the matrix",
            optional=True,
        ),
        "bytes_raw": Variable((), "int64", "byte", "The SSDFs in single precision"),
        "bytes_file": Variable((), "int64", "byte", "Of the compressed form on disk"),
        "bytes_memory": Variable((), "int64", "byte", "Resident while it is drawn"),
        "rmse": Variable((), "float64", "rad", "Error in memory, weighted by solid angle"),
        "wrong_visibility": Variable(
            (), "float64", "1", "Share of the sky above each vertex whose sign of d is wrong"
        ),
        "vertex_rmse": Variable(("vertex",), "float32", "rad", "Error of each vertex"),
    },
)

BOUNCE_FACTORS = Schema(
    _SYSTEM,
    "bounce_factors",
    1,
    "Form factors from vertices to patches of the surfaces, as a product of small matrices.",
    {
        "codes": Variable(("vertex", "factor"), "int8", "1", "Weights of each vertex, over steps"),
        "steps": Variable(("factor",), "float32", "1", "What a code of 1 stands for"),
        "vectors": Variable(("factor", "patch"), "float32", "1", "What is weighted"),
        "between": Variable(("patch", "factor"), "float32", "1", "Mean weights of each patch"),
        "albedo": Variable(("patch", "channel"), "float32", "1", "Mean reflectance, linear"),
        "samples": Variable(
            ("patch", "sample"), "int32", "1", "Vertices that tell how each patch is lit"
        ),
    },
)

ENVIRONMENT_LIGHTS = Schema(
    _SYSTEM,
    "environment_lights",
    1,
    "An environment as a sum of spherical Gaussians.",
    {
        "radiance": Variable(
            ("row", "column", "channel"),
            "float32",
            "1",
            "The environment, equirectangular, z up, averaged down to 1024 rows at most",
        ),
        "axes": Variable(("light", "axis"), "float64", "1", "p, unit vectors to the lights"),
        "sharpness": Variable(("light",), "float64", "1", "λ"),
        "amplitudes": Variable(("light", "channel"), "float64", "1", "μ, linear radiance"),
        "error": Variable((), "float64", "1", "Relative RMS error of radiance"),
        "tone_error": Variable((), "float64", "1", "Relative RMS error of log(1 + L / mean)"),
        "irradiance_error": Variable((), "float64", "1", "Relative RMS error of irradiance"),
        "shadowed_error": Variable(
            (), "float64", "1", "Relative RMS error of irradiance behind random occluders"
        ),
        "flux_error": Variable((), "float64", "1", "Relative error of the radiance's integral"),
    },
)

RELIT_FRAMES = Schema(
    _SYSTEM,
    "relit_frames",
    1,
    "The scene under the turning environment, drawn from the compressed SSDFs.",
    {
        "frames": Variable(
            ("frame", "y", "x", "channel"), "uint8", "1", "sRGB pictures", "figure 1"
        ),
        "turn": Variable(("frame",), "float64", "degree", "Turn of the environment about up"),
        "exposure": Variable((), "float64", "1", "Factor from radiance to the pictures"),
        "uncompressed": Variable(
            ("y", "x", "channel"), "uint8", "1", "The first frame from SSDFs not compressed"
        ),
        "direct": Variable(
            ("y", "x", "channel"), "uint8", "1", "The first frame without reflected light"
        ),
        "reference": Variable(
            ("y", "x", "channel"),
            "uint8",
            "1",
            "As `direct`, traced under the environment itself",
        ),
        "clusters": Variable(
            ("y", "x", "channel"), "uint8", "1", "Clusters in colours", "figure 2"
        ),
        "covered": Variable(("y", "x"), "float32", "1", "Share of each pixel that shows the scene"),
    },
)

LIT_PACKAGE = Schema(
    _SYSTEM,
    "lit_package",
    1,
    "The lit scene as a runtime package (docs/packages.md).",
    {"file": Variable(("byte",), "uint8", "1", "Bytes of the `.tsuya` file")},
)

SCHEMAS = (
    SCENE_MESH,
    VISIBILITY,
    SSDF_MATRIX,
    TRIANGLE_CLUSTERS,
    SSDF_BASIS,
    BOUNCE_FACTORS,
    ENVIRONMENT_LIGHTS,
    RELIT_FRAMES,
    LIT_PACKAGE,
)
