"""What the package of a lit scene holds."""

from __future__ import annotations

from storage.packages.schema import (
    ArrayPart,
    MeshPart,
    PackageSchema,
    Parameter,
    Part,
    PicturePart,
)

_DECODING = """\
Directions are unit vectors, z up. The scene's middle is the origin, its radius 1.

**Distances.** `ssdf` is a file whose page is `docs/ssdf_file.md`: from it follow n x n directions,
and d of each row `SOURCE` of the mesh in all of them; `root_weight` is the root that the page
divides by. (Drawn are columns at half the resolution, rounded:
`pipelines/ssdf_lighting/compression/resident.py`.) Without `ssdf` there are the paper's `vectors`
and `weights` instead: row i of the weights belongs to vertex `row_vertex`[i]; rows `row_first`[c]
to `row_first`[c + 1] are cluster c's, as many weights each as vectors between `first`[c] and
`first`[c + 1]; a vertex takes its first row.

Direction (x, y, z) lies at (x, y) / (|x| + |y| + |z|) of the square [-1, 1]², where z < 0 folded
out to (1 - |y|) sign x, (1 - |x|) sign y; texel (row, column) is number row * n + column, columns
along x. d is interpolated linearly between four texels; beyond the border lies the same border,
mirrored about its middle.

**Light.** The environment is the sum of `light_amplitudes` exp(λ (v·p - 1)), with axes p and λ
`light_sharpness`; the sharpest are suns. Turned by t degrees, its axes turn counter-clockwise
about z. Each light has a lobe of the matt part and one of the gloss at each vertex; d is looked
up along their axes and interpolated over the triangle: `lit_lobes.glsl` has the axes,
`ssdf_lookup.glsl` d, `sg_matt.glsl` and `sg_gloss.glsl` the radiance of a pixel. `gloss_lobes`
has, at cosines n·o from 0 to 1, the gloss as a Gaussian: λ, its axis as factors of the mirrored
view and of the normal, ln of its amplitude. Its rows are the materials', then, where materials
vary, those of 5 F0 from 0.02 to 0.99 times 12 slopes from 0.05 to 1, even in their logarithms,
slopes fastest. `LOBES` is the row whose axes a vertex has.

**Reflected light.** Surfaces are cut into patches. With s (P, 3), the mean over `bounce_samples`
of the matt parts' radiance for an albedo of 1 under direct light, b = `bounce_albedo` times s is
what patches send and g = `bounce_vectors` b; four times more b = `bounce_albedo` times (s +
`bounce_between` g) and g = `bounce_vectors` b. A vertex adds `bounce_codes` (`bounce_steps` g),
not below 0, interpolated and times the albedo.

**Materials** that vary: `factors` times what `map_*` says; colour maps are sRGB codes, surface
maps shares of F0 (red), of the roughness (green) and of the metalness (blue), normal maps as
glTF's. Beckmann's slope is the roughness squared.

Radiance times `exposure` is what the reference pictures show, before the colour `background`.
"""

_VARYING: dict[str, Part] = {
    "varying": ArrayPart(
        ("varying",), "int32", "1", "Row of each material that varies", optional=True
    ),
    "factors": ArrayPart(
        ("varying", "factor"),
        "float32",
        "1",
        "Base colour (3), metalness, F0 of what is no metal (3), roughness (root of the slope), "
        "bend of normals",
        optional=True,
    ),
    "map_of": ArrayPart(
        ("map", "place"),
        "int32",
        "1",
        "Row of the varying material, and what a map says: 0 colour, 1 surface, 2 normal",
        optional=True,
    ),
    "map_wrap": ArrayPart(
        ("map", "coordinate"),
        "int32",
        "1",
        "Outside of [0, 1]: 0 repeated, 1 mirrored, 2 clamped",
        optional=True,
    ),
    "map_mapping": ArrayPart(
        ("map",), "int32", "1", "Which of the two texture coordinates", optional=True
    ),
    "map_*": PicturePart("Texels of a map, by its number", units="code", optional=True),
}

_PAPERS_FORM: dict[str, Part] = {
    "vectors": ArrayPart(
        ("value", "direction"),
        "float16",
        "1",
        "The paper's form: left singular vectors, cluster by cluster",
        "section 2, U",
        optional=True,
    ),
    "first": ArrayPart(
        ("cluster_end",), "int32", "1", "Where a cluster's vectors begin", optional=True
    ),
    "row_vertex": ArrayPart(("row",), "int32", "1", "Vertex of each row of weights", optional=True),
    "row_first": ArrayPart(
        ("cluster_end",), "int32", "1", "Where a cluster's rows begin", optional=True
    ),
    "weights": ArrayPart(
        ("weight",), "float16", "radian", "Row by row", "section 2, S V", optional=True
    ),
}

_BOUNCE: dict[str, Part] = {
    "bounce_codes": ArrayPart(
        ("vertex", "factor"), "int8", "1", "Reflected light: weights of each row of the SSDFs"
    ),
    "bounce_steps": ArrayPart(("factor",), "float32", "1", "What a code of 1 stands for"),
    "bounce_vectors": ArrayPart(("factor", "patch"), "float32", "1", "What is weighted"),
    "bounce_between": ArrayPart(("patch", "factor"), "float32", "1", "Mean weights of each patch"),
    "bounce_albedo": ArrayPart(("patch", "channel"), "float32", "1", "Mean reflectance, linear"),
    "bounce_samples": ArrayPart(
        ("patch", "sample"), "int32", "1", "Rows of the SSDFs that tell how each patch is lit"
    ),
}

PACKAGE = PackageSchema(
    "ssdf_lighting",
    2,
    "A scene, its compressed spherical signed distance functions, and an environment.",
    {
        "mesh": MeshPart(
            "The surfaces in a sphere of radius 1, as they are drawn: vertices are doubled where "
            "materials or places in textures meet",
            units="scene radius",
            attributes={
                "SOURCE": "Row of the SSDFs",
                "MATERIAL": "Row of the materials",
                "LOBES": "Row of `gloss_lobes` whose axes the vertex has",
                "UV1": "Second texture coordinates, v from the bottom",
                "PAINT": "Linear colour that the base colour is multiplied by",
            },
        ),
        "triangle_cluster": ArrayPart(
            ("triangle",), "uint16", "1", "Cluster of each triangle", "section 2"
        ),
        "albedo": ArrayPart(("material", "channel"), "float32", "1", "Diffuse reflectance, linear"),
        "specular": ArrayPart(
            ("material",), "float32", "1", "Fresnel reflectance at normal incidence; 0 = no gloss"
        ),
        "roughness": ArrayPart(("material",), "float32", "1", "Beckmann's slope m"),
        "tint": ArrayPart(
            ("material", "channel"), "float32", "1", "What the gloss is multiplied by"
        ),
        "gloss_lobes": ArrayPart(
            ("row", "column", "value"),
            "float32",
            "1",
            "Gloss as a Gaussian, by the view's cosine: λ, along the mirrored view, along the "
            "normal, ln of the amplitude",
        ),
        **_VARYING,
        "ssdf": ArrayPart(
            ("byte",), "uint8", "1", "The compressed SSDFs, entropy coded", optional=True
        ),
        "root_weight": ArrayPart(
            ("direction",),
            "float32",
            "1",
            "Root of each direction's solid angle over their mean",
            optional=True,
        ),
        **_PAPERS_FORM,
        **_BOUNCE,
        "light_axes": ArrayPart(("light", "axis"), "float32", "1", "Unit vectors to the lights"),
        "light_sharpness": ArrayPart(("light",), "float32", "1", "λ of the lights"),
        "light_amplitudes": ArrayPart(
            ("light", "channel"), "float32", "1", "Linear radiance along the axes"
        ),
        "environment": ArrayPart(
            ("row", "column", "channel"),
            "float16",
            "1",
            "Linear radiance all around, equirectangular, row 0 at the zenith, averaged down; "
            "azimuth 0 in the middle, 90 degrees a quarter of the width from the left",
        ),
    },
    {
        "exposure": Parameter("1", "Factor on the radiance of the reference pictures"),
        "background": Parameter("1", "Linear radiance where no surface is, before the exposure"),
        "rmse": Parameter("radian", "Error of d by the compression, weighted by solid angle"),
        "irradiance_error": Parameter("1", "Relative RMS error of the lights' irradiance"),
        "shadowed_error": Parameter("1", "The same behind random occluders"),
    },
    _DECODING,
)
