"""A compressed BTF for other programs: decoder as ONNX, arrays, latents as a texture."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from storage.packages import Package
from tsuya.exports.format import Format, Notes

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

_SYSTEMS = ("neural_btf",)
_LAYERS = (1, 2, 3, 4)
_OPSET, _IR = 17, 8
"""Of ONNX 1.12 (2022): old enough for every runtime in use."""


def write_onnx(package: Package, target: Path) -> Notes:
    """The decoder as an ONNX model for any number n of samples.

    Inputs: ``latents`` (n, 8); ``light`` and ``view``, (n, 3) unit vectors in the texture's frame,
    z >= 0. Output: ``colour`` (n, 3), linear RGB over alpha. Raises BadInput.
    """
    import onnx
    from onnx import TensorProto, helper

    inputs = [
        helper.make_tensor_value_info(name, TensorProto.FLOAT, ["n", width])
        for name, width in (("latents", 8), ("light", 3), ("view", 3))
    ]
    output = helper.make_tensor_value_info("colour", TensorProto.FLOAT, ["n", 3])
    nodes = [*_plane("light"), *_plane("view"), *_network()]
    graph = helper.make_graph(nodes, "decoder", inputs, [output], _constants(package))
    model = helper.make_model(
        graph,
        opset_imports=[helper.make_opsetid("", _OPSET)],
        ir_version=_IR,
        producer_name="Tsuya",
        doc_string="Radiance is alpha times the colour, where it is negative 0.",
    )
    helper.set_model_props(model, _about(package))
    onnx.checker.check_model(model, full_check=True)
    onnx.save(model, str(target))
    return ("Latents of texels are not in it: `--to safetensors` or `--to ktx2` has them.",)


def write_safetensors(package: Package, target: Path) -> Notes:
    """All arrays under the names of their parts; alpha, height, width in the header. Raises
    BadInput."""
    import numpy as np
    from safetensors.numpy import save_file

    names = [name for name in package.parts if package.meta["parts"][name]["kind"] == "array"]
    arrays = {name: np.ascontiguousarray(package.array(name)) for name in names}
    save_file(arrays, str(target), metadata=_about(package))
    return ()


def write_ktx2(package: Package, target: Path) -> Notes:
    """Latents of each texel as an array texture of floats: layer 0 has the first four. Raises
    BadInput."""
    from storage.packages.ktx2 import ktx2_bytes

    target.write_bytes(ktx2_bytes(texel_latents(package)))
    return ("Texels that share latents have them each: the file is larger than the package.",)


def texel_latents(package: Package) -> NDArray[np.float32]:
    """Latents of texels, (2, height, width, 4), row 0 at the top. Raises BadInput."""
    import numpy as np

    latents = package.array("latents")
    if "ids" in package.parts:
        latents = latents[package.array("ids")]
    size = (int(package.parameter("height")), int(package.parameter("width")))
    return np.ascontiguousarray(np.moveaxis(latents.reshape(*size, 2, 4), 2, 0))


def _plane(name: str) -> list[Any]:
    """Unit vectors on the stereographic plane (paper 1, Eq. 7-9)."""
    from onnx import helper

    return [
        helper.make_node("Slice", [name, "zero", "two", "axis"], [f"{name}_xy"]),
        helper.make_node("Slice", [name, "two", "three", "axis"], [f"{name}_z"]),
        helper.make_node("Add", [f"{name}_z", "one"], [f"{name}_depth"]),
        helper.make_node("Div", [f"{name}_xy", f"{name}_depth"], [f"{name}_place"]),
    ]


def _network() -> list[Any]:
    from onnx import helper

    nodes = [
        helper.make_node("Concat", ["latents", "light_place", "view_place"], ["layer_0"], axis=1)
    ]
    for layer in _LAYERS:
        last = layer == _LAYERS[-1]
        said = "colour" if last else f"sum_{layer}"
        given = [f"layer_{layer - 1}", f"weight_{layer}", f"bias_{layer}"]
        nodes.append(helper.make_node("Gemm", given, [said], transB=1))
        if not last:
            nodes.append(helper.make_node("Relu", [said], [f"layer_{layer}"]))
    return nodes


def _constants(package: Package) -> list[Any]:
    import numpy as np
    from onnx import numpy_helper

    names = [f"{kind}_{layer}" for layer in _LAYERS for kind in ("weight", "bias")]
    values: dict[str, Any] = {name: package.array(name) for name in names}
    values |= {"zero": np.array([0]), "two": np.array([2]), "three": np.array([3])}
    values |= {"axis": np.array([1]), "one": np.array([1.0], np.float32)}
    return [numpy_helper.from_array(value, name) for name, value in values.items()]


def _about(package: Package) -> dict[str, str]:
    """What a reader must know, as texts."""
    about = {name: str(package.parameter(name)) for name in ("alpha", "height", "width")}
    return about | {
        "title": str(package.meta["title"]),
        "source": json.dumps(package.meta["source"]),
        "colour_space": str(package.meta.get("colour_space", "")),
        "latents of a texel": "row ids[texel] of latents, or row texel; texel = row * width + "
        "column, row 0 at the top",
    }


FORMATS = (
    Format("onnx", _SYSTEMS, ".onnx", "the decoder of a BTF as an ONNX model", write_onnx),
    Format(
        "safetensors", _SYSTEMS, ".safetensors", "decoder, latents, index list", write_safetensors
    ),
    Format("ktx2", _SYSTEMS, ".ktx2", "latents of texels as a float texture", write_ktx2),
)
