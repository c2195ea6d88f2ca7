"""The paper's tables 2, 3 and 4 and figure 8, of our materials: none, k = 500, 1000, 2000.

Every column is the paper's float32 form, trained fast on the photographs that `btf_paper_scale`
made; the file stands beside them. A draped cloth is drawn in each, from the same rays.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from assets_defs.launcher import Launcher, Request
from assets_defs.neural_btf.datasets import (
    abrdf_reader,
    compressed_btf_of,
    float_btf_file,
    pairs_of,
    runtime_btf,
)
from assets_defs.neural_btf.declaration import NONE
from assets_defs.neural_btf.graph import BTF
from benchmarks.btf_cloth import RAW, REFERENCE, DrapedCloths, cloth_errors, draped_cloths, tile_of
from benchmarks.btf_launching import timed
from pipelines.neural_btf.compressed import CompressedBtf
from pipelines.neural_btf.figures import table_bytes
from pipelines.neural_btf.material import Material, MeasuredBtf
from pipelines.neural_btf.restoration import restoration_errors
from storage.versions import Slot, VersionedStore

RESULTS = Path(__file__).parent / "results"
COLUMNS = ("500", "1000", "2000")
FILE = "file"
_GIVEN = {"form": "float32", "width": 64, "frames": 1, "cloth_samples": 2}
_WIDTH, _SAMPLES = 320, 128
_BLOCK = 400


def columns_path(material: str) -> Path:
    """Where a material's tables are committed."""
    return RESULTS / f"btf-columns-{material}.json"


def committed_columns(materials: tuple[str, ...]) -> dict[str, Any]:
    """The committed tables by material."""
    paths = {material: columns_path(material) for material in materials}
    return {m: json.loads(path.read_text()) for m, path in paths.items() if path.exists()}


def write_columns(launcher: Launcher, material: str) -> None:
    """Train a material's columns, and write its tables; its network without clusters is there."""
    from benchmarks.__main__ import commit, machine

    keys = [{"material": material, "clusters": column} for column in COLUMNS]
    with timed(f"{material}: {', '.join(COLUMNS)} clusters"):
        launcher.launch(Request(BTF, keys, "paper", _GIVEN))
    found = column_figures(launcher.workspace.store, material)
    about = {"material": material, "commit": commit(), "machine": machine()}
    columns_path(material).write_text(json.dumps(found | about, indent=1) + "\n")


def column_figures(store: VersionedStore, material: str) -> dict[str, Any]:
    """Bytes, RMSE over alpha of all photographs, errors of the draped cloth."""
    matrix = store.open(BTF.slot("abrdf_matrix", {"material": material})).load()
    read, pairs = abrdf_reader(matrix), pairs_of(matrix)
    forms = stored_forms(store, material)
    with timed(f"{material}: errors of {', '.join(forms)}"):
        errors = {
            name: restoration_errors(form, read, pairs, block=_BLOCK).rmse
            for name, form in forms.items()
        }
    texels = matrix.sizes["texel"]
    sizes = {name: table_bytes(int(name), texels) for name in COLUMNS}
    sizes[REFERENCE] = table_bytes(texels, texels)
    sizes[FILE] = store.open(_slot("compressed_btf", material, NONE)).sizes["byte"]
    with timed(f"{material}: draped cloth"):
        cloth = cloth_errors(draped_columns(measured_btf(store, material), forms))
    return {"texels": texels, "bytes": sizes, "rmse": errors, **cloth}


def draped_columns(measured: MeasuredBtf, forms: dict[str, CompressedBtf]) -> DrapedCloths:
    """Figure 8: the measured BTF, networks with and without clusters, the file."""
    shown: dict[str, Material] = {RAW: measured, **forms}
    tile = tile_of(forms[FILE].height, forms[FILE].width)
    return draped_cloths(shown, tile, width=_WIDTH, samples=_SAMPLES)


def measured_btf(store: VersionedStore, material: str) -> MeasuredBtf:
    """The photographs as they are."""
    images = store.open(BTF.slot("btf_images", {"material": material}))
    return MeasuredBtf(images["images"].values, pairs_of(images))


def stored_forms(store: VersionedStore, material: str) -> dict[str, CompressedBtf]:
    """The columns as they run, and the file."""
    matrix = store.open(BTF.slot("abrdf_matrix", {"material": material}))
    found = {}
    for column in (NONE, *COLUMNS):
        network, groups = (
            store.open(_slot(name, material, column)).load()
            for name in ("neural_btf", "abrdf_clusters")
        )
        name = REFERENCE if column == NONE else column
        found[name] = runtime_btf(float_btf_file(network, groups, matrix))
    file = store.open(_slot("compressed_btf", material, NONE)).load()
    return found | {FILE: compressed_btf_of(file)}


def _slot(asset: str, material: str, column: str) -> Slot:
    return BTF.slot(asset, {"material": material, "clusters": column})
