"""A compressed BTF for other programs: its file, decoder as ONNX, arrays, latents as textures."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from storage.packages import Package
from tsuya.exports.format import Format, Notes

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from pipelines.neural_btf.compressed import CompressedBtf

_SYSTEMS = ("neural_btf",)
_LAYERS = (1, 2, 3, 4)
_OPSET, _IR = 17, 8
"""Of ONNX 1.12 (2022): old enough for every runtime in use."""


def write_onnx(package: Package, target: Path) -> Notes:
    """The decoder as an ONNX model for any number n of samples.

    Inputs: ``latents`` (n, c); ``light`` and ``view``, (n, 3) unit vectors in the texture's frame,
    z >= 0. Output: ``colour`` (n, 3), linear RGB over alpha. Raises BadInput.
    """
    import onnx
    from onnx import TensorProto, helper

    channels = int(package.array("latents").shape[1])
    inputs = [
        helper.make_tensor_value_info(name, TensorProto.FLOAT, ["n", width])
        for name, width in (("latents", channels), ("light", 3), ("view", 3))
    ]
    output = helper.make_tensor_value_info("colour", TensorProto.FLOAT, ["n", 3])
    nodes = [*_plane("light"), *_plane("view"), *_network()]
    graph = helper.make_graph(nodes, "decoder", inputs, [output], _constants(package))
    model = helper.make_model(
        graph,
        opset_imports=[helper.make_opsetid("", _OPSET)],
        ir_version=_IR,
        producer_name="Tsuya",
        doc_string="Radiance is alpha times the colour, held to least and largest, at least 0.",
    )
    helper.set_model_props(model, _about(package))
    onnx.checker.check_model(model, full_check=True)
    onnx.save(model, str(target))
    return ("Latents of texels are not in it: `--to safetensors` or `--to ktx2` has them.",)


def write_safetensors(package: Package, target: Path) -> Notes:
    """All numbers as float32 under the names of `compressed_arrays`; alpha, size and bounds in the
    header. Raises BadInput."""
    from safetensors.numpy import save_file

    from tsuya.exports.packaged_btf import packaged_btf

    save_file(compressed_arrays(packaged_btf(package)), str(target), metadata=_about(package))
    return ()


def compressed_arrays(btf: CompressedBtf) -> dict[str, NDArray[Any]]:
    """A runtime BTF's arrays by name.

    ``weight_1`` … ``bias_4``, the same with ``student_`` before; ``latents`` (k, c), ``ids``
    (texel,) where texels share them; ``mips_1`` … (texel, c); ``parallax`` (9, 2). What there is
    not is left out.
    """
    import numpy as np

    arrays: dict[str, Any] = {**btf.decoder, "latents": btf.latents}
    arrays |= {f"student_{name}": part for name, part in (btf.student or {}).items()}
    arrays |= {f"mips_{number}": level for number, level in enumerate(btf.mips, 1)}
    arrays |= {} if btf.ids is None else {"ids": btf.ids}
    arrays |= {} if btf.parallax is None else {"parallax": btf.parallax}
    return {name: np.ascontiguousarray(part) for name, part in arrays.items()}


def write_ktx2(package: Package, target: Path) -> Notes:
    """A folder with latents of each level as an array texture of floats, `level_0.ktx2` …: four a
    layer. Raises BadInput.

    Not levels of one file: those of KTX 2 round sizes down, ours up, as all texels belong to one.
    """
    from storage.packages.ktx2 import ktx2_bytes
    from tsuya.exports.packaged_btf import packaged_btf

    target.mkdir(parents=True, exist_ok=True)
    for number, level in enumerate(level_latents(packaged_btf(package))):
        (target / f"level_{number}.ktx2").write_bytes(ktx2_bytes(level))
    return ("Texels that share latents have them each: the files are larger than the package.",)


def level_latents(btf: CompressedBtf) -> list[NDArray[np.float32]]:
    """Latents of texels of each level, (layer, height, width, 4), padded by 0, row 0 at the top."""
    import numpy as np

    from pipelines.neural_btf.latent_texture import level_sizes

    tables = (btf.latents_of(slice(None)), *btf.mips)
    sizes = level_sizes(btf.height, btf.width)[: len(tables)]
    padding = ((0, 0), (0, -btf.latents.shape[1] % 4))
    return [
        np.ascontiguousarray(np.moveaxis(np.pad(table, padding).reshape(*size, -1, 4), 2, 0))
        for table, size in zip(tables, sizes, strict=True)
    ]


def write_tbtf(package: Package, target: Path) -> Notes:
    """The file that the package was made of, byte by byte (docs/btf_file.md). Raises BadInput."""
    from storage.btf_file import write_btf_file
    from tsuya.exports.packaged_btf import packaged_file

    target.write_bytes(write_btf_file(packaged_file(package)))
    return ()


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

    from tsuya.exports.packaged_btf import packaged_btf

    values: dict[str, Any] = dict(packaged_btf(package).decoder)
    values |= {"zero": np.array([0]), "two": np.array([2]), "three": np.array([3])}
    values |= {"axis": np.array([1]), "one": np.array([1.0], np.float32)}
    return [numpy_helper.from_array(value, name) for name, value in values.items()]


def _about(package: Package) -> dict[str, str]:
    """What a reader must know, as texts."""
    names = ("alpha", "height", "width", "least", "largest")
    about = {name: str(package.parameter(name)) for name in names}
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
        "safetensors",
        _SYSTEMS,
        ".safetensors",
        "decoder, latents of all levels, parallax as floats",
        write_safetensors,
    ),
    Format("ktx2", _SYSTEMS, "", "latents of texels as float textures, one a level", write_ktx2),
    Format("tbtf", _SYSTEMS, ".tbtf", "the compressed BTF as its file", write_tbtf),
)
