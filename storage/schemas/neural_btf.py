"""Datasets of the neural BTF: photographs, ABRDFs, clusters, networks, restored pictures."""

import itertools

from storage.schemas.schema import Schema, Variable

_SYSTEM = "neural_btf"
_PIXELS = ("y", "x")


def _decoder() -> dict[str, Variable]:
    layers = ("input", "hidden_1", "hidden_2", "hidden_3", "channel")
    variables = {}
    for number, (before, after) in enumerate(itertools.pairwise(layers), start=1):
        variables[f"weight_{number}"] = Variable(
            (after, before), "float32", "1", f"Decoder: weights of layer {number}", "figure 5"
        )
        variables[f"bias_{number}"] = Variable(
            (after,), "float32", "1", f"Decoder: biases of layer {number}", "figure 5"
        )
    return variables


BTF_IMAGES = Schema(
    _SYSTEM,
    "btf_images",
    1,
    "Photographs of a material under every pair of light and view, in linear light.",
    {
        "images": Variable(
            ("image", *_PIXELS, "channel"),
            "float16",
            "1",
            "Linear RGB (sRGB primaries); a white Lambertian surface has the cosine of the light",
        ),
        "light": Variable(
            ("image", "angle"), "float64", "radian", "Light: theta from the normal, phi", "figure 1"
        ),
        "view": Variable(
            ("image", "angle"), "float64", "radian", "View: theta from the normal, phi", "figure 1"
        ),
    },
)

ABRDF_MATRIX = Schema(
    _SYSTEM,
    "abrdf_matrix",
    1,
    "The same values texel by texel, with their statistics and principal components.",
    {
        "abrdfs": Variable(
            ("texel", "image", "channel"),
            "float16",
            "1",
            "Linear RGB of every texel in every photograph, texels row by row",
            "Eq. 1, x1",
        ),
        "mean": Variable(
            ("image", "channel"), "float32", "1", "Mean of log(x1 + 1) over the texels", "Eq. 2, mu"
        ),
        "deviation": Variable(
            ("image", "channel"), "float32", "1", "Standard deviation of it", "Eq. 3, sigma"
        ),
        "alpha": Variable((), "float64", "1", "Largest value of all", "Eq. 5"),
        "scores": Variable(
            ("texel", "component"), "float32", "1", "Principal components of the ABRDFs",
            "section 3.1",
        ),
        "singular_values": Variable(
            ("component",), "float64", "1", "Length of every component's scores"
        ),
        "total_variation": Variable(
            (), "float64", "1", "Sum of squares of the centred matrix: what all components explain"
        ),
        "light": Variable(("image", "angle"), "float64", "radian", "Light: theta, phi"),
        "view": Variable(("image", "angle"), "float64", "radian", "View: theta, phi"),
        "height": Variable((), "int32", "texels", "Rows of texels"),
        "width": Variable((), "int32", "texels", "Texels of a row"),
    },
)  # fmt: skip

ABRDF_CLUSTERS = Schema(
    _SYSTEM,
    "abrdf_clusters",
    1,
    "Which texels share their latents, and the ABRDF that stands for them.",
    {
        "ids": Variable(("texel",), "int32", "1", "Cluster of every texel", "section 3.1"),
        "sizes": Variable(("cluster",), "int64", "texels", "Members of every cluster"),
        "representatives": Variable(
            ("cluster", "image", "channel"),
            "float32",
            "1",
            "What the encoder sees of a cluster; without clustering, the texel's own ABRDF",
            "section 3.1",
            optional=True,
        ),
        "start": Variable(
            ("cluster", "latent"),
            "float32",
            "1",
            "Mean principal components of the members, deviation 1: where fast training starts",
        ),
    },
)

NEURAL_BTF = Schema(
    _SYSTEM,
    "neural_btf",
    1,
    "The trained network: encoder, decoder, latents, loss curve.",
    {
        **_decoder(),
        "latents": Variable(("cluster", "latent"), "float32", "1", "Latent vectors", "figure 5"),
        "encoder": Variable(
            ("parameter",), "float32", "1", "Parameters and batch statistics of the encoder",
            "figure 5",
        ),
        "curve_step": Variable(("point",), "int64", "1", "Steps of training"),
        "curve_rmse": Variable(
            ("point",), "float64", "alpha", "Root of the mean loss since the point before"
        ),
        "encoder_residual": Variable(
            (),
            "float64",
            "1",
            "RMSE of the encoder's latents against the stored ones, in their deviations",
            optional=True,
        ),
    },
)  # fmt: skip

COMPRESSED_BTF = Schema(
    _SYSTEM,
    "compressed_btf",
    1,
    "The runtime BTF of table 1: decoder, latents and, where texels share them, the index list.",
    {
        **_decoder(),
        "latents": Variable(("cluster", "latent"), "float32", "1", "Latent vectors", "table 1"),
        "ids": Variable(
            ("texel",), "int32", "1", "Latent vector of every texel", "table 1", optional=True
        ),
        "alpha": Variable((), "float64", "1", "Radiance that the decoder's 1 stands for", "Eq. 5"),
        "height": Variable((), "int32", "texels", "Rows of texels"),
        "width": Variable((), "int32", "texels", "Texels of a row"),
    },
)

RESTORED_IMAGES = Schema(
    _SYSTEM,
    "restored_images",
    1,
    "Restored photographs beside the measured ones, and the errors of all.",
    {
        "original": Variable(
            ("pair", *_PIXELS, "channel"), "float32", "1", "Measured linear RGB", "figure 7"
        ),
        "restored": Variable(
            ("pair", *_PIXELS, "channel"), "float32", "1", "Restored linear RGB", "figure 7"
        ),
        "pair_light": Variable(("pair", "angle"), "float64", "radian", "Light: theta, phi"),
        "pair_view": Variable(("pair", "angle"), "float64", "radian", "View: theta, phi"),
        "rmse": Variable((), "float64", "alpha", "Over all photographs and texels", "Eq. 10"),
        "rmse_image": Variable(("image",), "float64", "alpha", "Of every photograph"),
        "rmse_texel": Variable(_PIXELS, "float64", "alpha", "Of every texel"),
        "light": Variable(("image", "angle"), "float64", "radian", "Light: theta, phi"),
        "view": Variable(("image", "angle"), "float64", "radian", "View: theta, phi"),
    },
)

CLOTH_FRAMES = Schema(
    _SYSTEM,
    "cloth_frames",
    1,
    "A folded panel of the material under a light that moves around it.",
    {
        "frames": Variable(
            ("frame", *_PIXELS, "channel"), "uint8", "1", "sRGB pictures, one a light"
        ),
        "light_direction": Variable(
            ("frame", "angle"), "float64", "radian", "Light in the panel's frame: theta, phi"
        ),
        "coverage": Variable((), "float64", "1", "Share of the picture's pixels with cloth"),
    },
)

BTF_PACKAGE = Schema(
    _SYSTEM,
    "btf_package",
    1,
    "The compressed BTF as a runtime package (docs/packages.md).",
    {"file": Variable(("byte",), "uint8", "1", "Bytes of the `.tsuya` file")},
)

SCHEMAS = (
    BTF_IMAGES,
    ABRDF_MATRIX,
    ABRDF_CLUSTERS,
    NEURAL_BTF,
    COMPRESSED_BTF,
    RESTORED_IMAGES,
    CLOTH_FRAMES,
    BTF_PACKAGE,
)
