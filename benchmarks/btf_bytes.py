"""Table 1: the bytes of stored versions of the paper's shape."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from assets_defs.neural_btf.datasets import compressed_btf_dataset
from assets_defs.neural_btf.declaration import BTF, NONE
from pipelines.neural_btf.network import Decoder, decoder_arrays
from storage.btf_file import BtfFile, section_bytes
from storage.schemas import find_schema
from storage.versions import Slot, VersionedStore

COLUMNS = (NONE, "500", "1000", "2000")
IMAGES = 6561
SIDE = 100
_PAYLOAD = ("decoder", "latents", "ids")


def table_of_bytes() -> dict[str, Any]:
    """Payloads read back from stored versions of the paper's shape, untrained."""
    texels = SIDE * SIDE
    figures: dict[str, Any] = {}
    sides = {}
    with tempfile.TemporaryDirectory() as folder:
        store = VersionedStore(Path(folder))
        for column in COLUMNS:
            dataset = compressed_btf_dataset(_untrained(texels if column == NONE else int(column)))
            slot = Slot(BTF.name, "compressed_btf", column)
            record = {"settings": {}, "recipe": "", "checks": []}
            store.write(slot, find_schema(BTF.name, "compressed_btf").conform(dataset), record)
            stored = store.open(slot).load()
            sections = section_bytes(stored["file"].values.tobytes())
            payload = sum(sections[name] for name in _PAYLOAD)
            figures[f"bytes_{column}"] = payload
            sides[column] = stored.sizes["byte"] - payload
    figures["bytes_side"] = max(sides.values())
    figures["bytes_raw_float32"] = IMAGES * texels * 3 * 4
    figures["bytes_raw_8bit"] = IMAGES * texels * 3
    return figures


def _untrained(clusters: int) -> BtfFile:
    """The paper's form."""
    random = np.random.default_rng(clusters)
    latents = random.standard_normal((clusters, 8), dtype=np.float32)
    ids = random.integers(0, clusters, SIDE * SIDE, dtype=np.int32)
    shared = ids if clusters < SIDE * SIDE else None
    return BtfFile(decoder_arrays(Decoder()), latents, SIDE, SIDE, 1.0, shared)
