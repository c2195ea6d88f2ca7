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
    2,
    "The trained network: encoder, decoder, latents, loss curve.",
    {
        **_decoder(),
        "latents": Variable(("cluster", "latent"), "float32", "1", "Latent vectors", "figure 5"),
        "parallax": Variable(
            ("monomial", "axis"), "float32", "texel",
            "Columns and rows by which latents are looked up beside a texel, by the view",
            optional=True,
        ),
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
    2,
    "The runtime BTF as one file: decoder, latents, and which texel has which (docs/btf_file.md).",
    {
        "file": Variable(("byte",), "uint8", "1", "Bytes of the `.tbtf` file", "table 1"),
        "curve_step": Variable(
            ("point",), "int64", "1", "Steps of training with quantisation", optional=True
        ),
        "curve_rmse": Variable(
            ("point",), "float64", "alpha", "Root of the mean squared error since the point before",
            optional=True,
        ),
    },
)  # fmt: skip


def _quality() -> dict[str, Variable]:
    """Figures of restored photographs, each beside that of restorations that know nothing.

    Optional are those of views that not every material was photographed from, and of SSIM, which
    small photographs have not.
    """
    null, shuffled = "of every photograph's mean colour", "of restored texels in a drawn order"
    nulls = {"_null": null, "_shuffled": shuffled}
    grazing = "views at 60 degrees and more"
    deviation, contrast = "over the deviation of all values", "over the RMSE of mean colours"
    kinds: dict[str, tuple[str, str, tuple[str, ...]]] = {
        "rmse": ("alpha", "RMSE over all photographs and texels", ("_null", "_shuffled")),
        "rmse_over_deviation": ("1", f"RMSE {deviation}", ("_null",)),
        "rmse_over_null": ("1", f"RMSE {contrast}", ("_shuffled",)),
        "rmse_over_null_60": ("1", f"RMSE {contrast}, {grazing}", ("_shuffled",)),
        "worst_photographs": ("1", f"RMSE of the worst tenth, {deviation}", ("_null",)),
        "worst_texels": ("1", f"RMSE of the worst tenth, {deviation}", ("_null",)),
        "grazing_detail": ("1", f"Gradients kept and right, {grazing}", ()),
        "grazing_energy": ("1", f"Energy of gradients over the measured, {grazing}", ()),
    }
    for name, units, words in (
        ("psnr", "dB", "PSNR of judged photographs as pictures"),
        ("ssim", "1", "SSIM of judged photographs as pictures"),
        ("flip", "1", "FLIP of judged photographs as pictures"),
    ):
        kinds[name] = (units, words, tuple(nulls))
        kinds[f"{name}_60"] = (units, f"{words}, {grazing}", tuple(nulls))
    found = {}
    for name, (units, words, beside) in kinds.items():
        optional = "60" in name or "grazing" in name or "ssim" in name
        source = "Eq. 10" if name == "rmse" else ""
        found[name] = Variable((), "float64", units, words, source, optional=optional)
        for null_name in beside:
            meaning = f"{words}, {nulls[null_name]}"
            found[name + null_name] = Variable((), "float64", units, meaning, optional=optional)
    return found


RESTORED_IMAGES = Schema(
    _SYSTEM,
    "restored_images",
    2,
    "Restored photographs beside the measured ones, the errors of all, figures of quality.",
    {
        "original": Variable(
            ("pair", *_PIXELS, "channel"), "float32", "1", "Measured linear RGB", "figure 7"
        ),
        "restored": Variable(
            ("pair", *_PIXELS, "channel"), "float32", "1", "Restored linear RGB", "figure 7"
        ),
        "pair_light": Variable(("pair", "angle"), "float64", "radian", "Light: theta, phi"),
        "pair_view": Variable(("pair", "angle"), "float64", "radian", "View: theta, phi"),
        **_quality(),
        "rmse_image": Variable(("image",), "float64", "alpha", "Of every photograph"),
        "rmse_texel": Variable(_PIXELS, "float64", "alpha", "Of every texel"),
        "light": Variable(("image", "angle"), "float64", "radian", "Light: theta, phi"),
        "view": Variable(("image", "angle"), "float64", "radian", "View: theta, phi"),
    },
)

CLOTH_FRAMES = Schema(
    _SYSTEM,
    "cloth_frames",
    2,
    "A draped cloth of the material under a sky with a sun: around it, the sun around it, close.",
    {
        "orbit": Variable(
            ("frame", *_PIXELS, "channel"), "uint8", "1", "sRGB pictures; the camera goes around",
            "figure 8",
        ),
        "moving_light": Variable(
            ("frame", *_PIXELS, "channel"), "uint8", "1", "sRGB pictures; the sun goes around",
        ),
        "closeup": Variable(
            (*_PIXELS, "channel"), "uint8", "1", "sRGB picture from a hand's breadth away"
        ),
        "camera_azimuth": Variable(("frame",), "float64", "degree", "Of the orbit's camera"),
        "sun_azimuth": Variable(("frame",), "float64", "degree", "Of the moving light's sun"),
        "compared": Variable(
            ("material", "small_y", "small_x", "channel"), "float32", "1",
            "The close-up, small, of the compressed BTF, of the measured one and of its mean "
            "colour: linear RGB, exposed as the close-up",
        ),
    },
)  # fmt: skip

RATE_DISTORTION = Schema(
    _SYSTEM,
    "rate_distortion",
    1,
    "What bytes buy: RMSE of files of many sizes, made of one network; `rate` is bytes, RMSE.",
    {
        "bits": Variable(("bits",), "int64", "1", "Bits of a latent, plainly rounded"),
        "rounded": Variable(
            ("bits", "rate"), "float64", "alpha", "Files of weights in 8 bits, latents in so many"
        ),
        "clusters": Variable(("clusters",), "int64", "1", "Clusters of texels that share latents"),
        "clustered": Variable(
            ("clusters", "rate"), "float64", "alpha", "Files of mean latents, not trained further"
        ),
        "gained": Variable(
            ("clusters", "rate"), "float64", "alpha", "The same with a gain of a byte a texel"
        ),
        "float32": Variable(("rate",), "float64", "alpha", "The paper's form", "table 1"),
        "file": Variable(("rate",), "float64", "alpha", "The file, trained to be rounded"),
        "null": Variable((), "float64", "alpha", "RMSE of the mean ABRDF for every texel"),
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
    RATE_DISTORTION,
    BTF_PACKAGE,
)
