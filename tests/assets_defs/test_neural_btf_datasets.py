"""BTF datasets and the objects of `pipelines`: what goes in comes out, and fits its schema."""

from __future__ import annotations

import dataclasses
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
import xarray as xr
from numpy.typing import NDArray

from assets_defs.neural_btf import datasets
from pipelines.light.directions import Pairs, all_pairs, hemisphere_table
from pipelines.neural_btf.abrdf import PhotographBlocks, transposed
from pipelines.neural_btf.clusters import (
    AbrdfClusters,
    cluster_abrdfs,
    single_texel_clusters,
)
from pipelines.neural_btf.compressed import CompressedBtf
from pipelines.neural_btf.draping.frames import ClothFrames
from pipelines.neural_btf.latent_texture import level_sizes
from pipelines.neural_btf.network import Decoder, Encoder, decoder_arrays, encoder_vector
from pipelines.neural_btf.principal_abrdfs import AbrdfSummary, summarise_abrdfs
from pipelines.neural_btf.restoration import restoration_errors
from pipelines.neural_btf.training.fine_tuning import QuantisedNetwork
from pipelines.neural_btf.training.trainer import TrainedNetwork
from storage.btf_file import BtfFile
from storage.schemas import neural_btf as schemas
from storage.versions import Slot, VersionedStore

HEIGHT, WIDTH, CLUSTERS = 6, 8, 5
PAIRS: Pairs = all_pairs(hemisphere_table(15), hemisphere_table(15))


def lazy(images: NDArray[np.floating], asked: list[Any] | None = None) -> datasets.LazyPhotographs:
    def read(first: int, last: int) -> NDArray[np.float32]:
        if asked is not None:
            asked.append((first, last))
        return images[first:last].astype(np.float32)

    return datasets.LazyPhotographs(PAIRS, HEIGHT, WIDTH, 15, read, {"layout": "made up"})


@pytest.fixture(scope="module")
def images() -> NDArray[np.float16]:
    random = np.random.default_rng(0)
    return random.gamma(1.0, 0.5, (225, HEIGHT, WIDTH, 3)).astype(np.float16)


@pytest.fixture(scope="module")
def summary(images: NDArray[np.float16]) -> AbrdfSummary:
    return summarise_abrdfs(PhotographBlocks.of_array(images), components=9)


@pytest.fixture
def btf_images(images: NDArray[np.float16]) -> xr.Dataset:
    return datasets.btf_images_dataset(lazy(images), "cloth.zip")


@pytest.fixture(scope="module")
def compressed() -> CompressedBtf:
    torch.manual_seed(0)
    random = np.random.default_rng(1)
    latents = random.standard_normal((CLUSTERS, 8)).astype(np.float32)
    ids = random.integers(0, CLUSTERS, HEIGHT * WIDTH).astype(np.int32)
    return CompressedBtf(
        decoder_arrays(Decoder()), latents, ids, 1.75, HEIGHT, WIDTH, least=0.0, largest=1.0
    )


def file_of(btf: CompressedBtf) -> BtfFile:
    """The paper's form."""
    return BtfFile(btf.decoder, btf.latents, btf.height, btf.width, btf.alpha, btf.ids)


def assert_same(one: Any, other: Any) -> None:
    for name, a, b in zip(one._fields, one, other, strict=True):
        assert (a is None) == (b is None), name
        np.testing.assert_array_equal(a, b, err_msg=name)
        assert np.asarray(a).dtype == np.asarray(b).dtype, name


# ---- photographs -----------------------------------------------------------------------------


def test_photographs_are_read_a_view_at_a_time_when_they_are_wanted(
    images: NDArray[np.float16],
) -> None:
    asked: list[Any] = []
    dataset = datasets.btf_images_dataset(lazy(images, asked), "cloth.zip")
    dataset = schemas.BTF_IMAGES.conform(dataset)
    assert dataset.attrs == {"name": "cloth.zip", "layout": "made up"}
    assert asked == []
    np.testing.assert_array_equal(dataset["images"][15:30].values, images[15:30])
    assert asked == [(15, 30)]
    assert_same(datasets.pairs_of(dataset), PAIRS)


def test_blocks_are_the_chunks_and_can_be_read_again(
    btf_images: xr.Dataset, images: NDArray[np.float16]
) -> None:
    blocks = datasets.photograph_blocks(btf_images["images"])
    assert blocks.images == 225
    for _ in range(2):
        parts = list(blocks)
        assert [len(part) for part in parts] == [15] * 15
        np.testing.assert_array_equal(np.concatenate(parts), images)
    (whole,) = datasets.photograph_blocks(btf_images["images"].load())
    np.testing.assert_array_equal(whole, images)


@pytest.mark.parametrize("value", [np.nan, 70_000.0, -1.0])
def test_values_that_cannot_be_stored_are_refused_when_they_are_read(
    images: NDArray[np.float16], value: float
) -> None:
    wrong = images.astype(np.float32)
    wrong[200, 1, 2, 0] = value
    dataset = datasets.btf_images_dataset(lazy(wrong), "cloth.zip")
    assert np.isfinite(dataset["images"][:15].values).all()
    with pytest.raises(ValueError, match="BTF: "):
        dataset["images"][195:210].compute()


# ---- ABRDFs, clusters ------------------------------------------------------------------------


def test_a_matrix_holds_the_transposed_photographs_and_the_summary(
    btf_images: xr.Dataset, images: NDArray[np.float16], summary: AbrdfSummary
) -> None:
    dataset = datasets.abrdf_matrix_dataset(summary, btf_images)
    dataset = schemas.ABRDF_MATRIX.conform(dataset)
    assert dataset["abrdfs"].chunks is not None  # transposed while it is stored
    np.testing.assert_array_equal(dataset["abrdfs"].values, transposed(images))
    np.testing.assert_array_equal(datasets.abrdf_reader(dataset)(7, 11), transposed(images)[7:11])
    assert float(dataset["alpha"]) == images.max()
    assert (int(dataset["height"]), int(dataset["width"])) == (HEIGHT, WIDTH)
    np.testing.assert_array_equal(dataset["deviation"].values, summary.statistics.deviation)


@pytest.mark.parametrize("clusters", [None, CLUSTERS])
def test_clusters_come_back(
    images: NDArray[np.float16], summary: AbrdfSummary, clusters: int | None
) -> None:
    found = (
        single_texel_clusters(summary.scores)
        if clusters is None
        else cluster_abrdfs(
            PhotographBlocks.of_array(images), summary.scores, clusters, representative="mean"
        )
    )
    dataset = datasets.abrdf_clusters_dataset(found, (HEIGHT, WIDTH))
    dataset = schemas.ABRDF_CLUSTERS.conform(dataset)
    assert dataset.attrs == {"height": HEIGHT, "width": WIDTH}
    back = datasets.abrdf_clusters_of(dataset)
    assert isinstance(back, AbrdfClusters)
    assert_same(back, found)


# ---- networks --------------------------------------------------------------------------------


@pytest.mark.parametrize("residual", [None, 0.25])
def test_a_trained_network_comes_back(residual: float | None) -> None:
    torch.manual_seed(1)
    encoder = Encoder(225, (4, 6))
    encoder(torch.randn(9, 225, 3))  # batch statistics that are not those of the beginning
    latents = np.random.default_rng(2).standard_normal((CLUSTERS, 8)).astype(np.float32)
    curve = np.arange(1, 4), np.array([0.5, 0.25, 0.125])
    parallax = None if residual is None else np.ones((9, 2), np.float32)
    trained = TrainedNetwork(encoder.eval(), Decoder().eval(), latents, parallax, *curve, residual)
    dataset = schemas.NEURAL_BTF.conform(datasets.neural_btf_dataset(trained))
    assert dataset.attrs["widths"] == [4, 6]
    back = datasets.trained_network_of(dataset, 225)
    np.testing.assert_array_equal(encoder_vector(back.encoder), encoder_vector(encoder))
    assert back.encoder.widths == (4, 6)
    assert not back.encoder.training
    for name, part in decoder_arrays(trained.decoder).items():
        np.testing.assert_array_equal(decoder_arrays(back.decoder)[name], part)
    assert_same(
        back._replace(encoder=None, decoder=None), trained._replace(encoder=None, decoder=None)
    )


def assert_same_btf(one: CompressedBtf, other: CompressedBtf) -> None:
    np.testing.assert_array_equal(one.photographs(PAIRS), other.photographs(PAIRS))
    assert (one.height, one.width) == (other.height, other.width)
    assert (one.ids is None) == (other.ids is None)
    assert one.payload_bytes == other.payload_bytes


@pytest.mark.parametrize("clustered", [True, False])
def test_a_compressed_btf_comes_back(compressed: CompressedBtf, clustered: bool) -> None:
    if not clustered:
        latents = compressed.latents[compressed.ids]
        compressed = dataclasses.replace(compressed, latents=latents, ids=None)
    dataset = datasets.compressed_btf_dataset(file_of(compressed))
    dataset = schemas.COMPRESSED_BTF.conform(dataset)
    assert dataset.sizes["byte"] == dataset["file"].nbytes < compressed.payload_bytes + 400
    assert_same_btf(datasets.compressed_btf_of(dataset), compressed)


def groups_of(ids: NDArray[np.integer]) -> xr.Dataset:
    groups = AbrdfClusters(ids, np.bincount(ids), None, np.zeros((CLUSTERS, 8), np.float32))
    return datasets.abrdf_clusters_dataset(groups, (HEIGHT, WIDTH))


def test_the_papers_form_is_put_together_from_network_clusters_and_matrix(
    btf_images: xr.Dataset, summary: AbrdfSummary, compressed: CompressedBtf
) -> None:
    trained = TrainedNetwork(
        Encoder(225, (4,)), Decoder(), compressed.latents, None, np.arange(2), np.ones(2), None
    )
    assert compressed.ids is not None
    found = datasets.float_btf_file(
        datasets.neural_btf_dataset(trained),
        groups_of(compressed.ids),
        datasets.abrdf_matrix_dataset(summary, btf_images),
    )
    expected = dataclasses.replace(
        compressed, decoder=decoder_arrays(trained.decoder), alpha=summary.alpha
    )
    assert_same_btf(datasets.runtime_btf(found), expected)


def test_whole_numbers_become_the_values_that_they_stand_for(
    btf_images: xr.Dataset, summary: AbrdfSummary, compressed: CompressedBtf
) -> None:
    random = np.random.default_rng(3)

    def symbols(*shape: int) -> NDArray[np.int32]:
        return random.integers(-9, 10, shape).astype(np.int32)

    step = np.float32(0.25).reshape(())
    decoder = {name: (symbols(*part.shape), step) for name, part in compressed.decoder.items()}
    small = {
        name: (symbols(*part.shape), step) for name, part in decoder_arrays(Decoder(4)).items()
    }
    steps = np.linspace(0.1, 0.8, 8, dtype=np.float32)
    mips = tuple(symbols(rows * columns, 8) for rows, columns in level_sizes(HEIGHT, WIDTH)[1:])
    network = QuantisedNetwork(
        decoder, symbols(CLUSTERS, 8), steps, mips, steps / 2, None, small, np.arange(2), np.ones(2)
    )
    assert compressed.ids is not None
    matrix = datasets.abrdf_matrix_dataset(summary, btf_images)
    held = datasets.quantised_btf_file(network, groups_of(compressed.ids), matrix)
    curve = network.curve_step, network.curve_rmse
    dataset = schemas.COMPRESSED_BTF.conform(datasets.compressed_btf_dataset(held, curve))
    found = datasets.compressed_btf_of(dataset)
    np.testing.assert_array_equal(found.latents, network.latents.astype(np.float32) * steps)
    np.testing.assert_array_equal(found.mips[1], mips[1].astype(np.float32) * (steps / 2))
    np.testing.assert_array_equal(found.decoder["weight_2"], decoder["weight_2"][0] * step)
    np.testing.assert_array_equal(found.by_student().decoder["bias_1"], small["bias_1"][0] * step)
    np.testing.assert_array_equal(found.ids, compressed.ids)
    assert (found.alpha, found.least, found.largest) == (summary.alpha, 0.0, 1.0)


# ---- pictures --------------------------------------------------------------------------------


def test_restored_photographs_and_frames_fit_their_schemas(
    btf_images: xr.Dataset, images: NDArray[np.float16], compressed: CompressedBtf
) -> None:
    abrdfs = transposed(images)
    errors = restoration_errors(compressed, lambda a, b: abrdfs[a:b], PAIRS, block=20)
    shown = np.array([7, 200])
    dataset = datasets.restored_images_dataset(compressed, errors, btf_images, shown)
    dataset = schemas.RESTORED_IMAGES.conform(dataset)
    np.testing.assert_array_equal(dataset["original"].values, images[shown])
    np.testing.assert_array_equal(
        dataset["restored"].values, compressed.photographs(Pairs(*(p[shown] for p in PAIRS)))
    )
    np.testing.assert_array_equal(dataset["rmse_texel"].values.ravel(), errors.of_texel)
    pictures = np.zeros((2, 9, 12, 3), np.uint8)
    frames = ClothFrames(pictures, pictures, pictures[0], np.zeros((3, 6, 8, 3), np.float32))
    drawn = schemas.CLOTH_FRAMES.conform(datasets.cloth_frames_dataset(frames))
    assert np.diff(drawn["sun_azimuth"]).tolist() == [180.0]


# ---- tsuya.load ------------------------------------------------------------------------------


def test_a_stored_btf_is_loaded_without_torch(
    compressed: CompressedBtf, tmp_path_factory: pytest.TempPathFactory
) -> None:
    root: Path = tmp_path_factory.mktemp("store")
    store = VersionedStore(root)
    dataset = datasets.compressed_btf_dataset(file_of(compressed))
    dataset = schemas.COMPRESSED_BTF.conform(dataset)
    record = {"settings": {}, "recipe": "", "checks": []}
    store.write(Slot("neural_btf", "compressed_btf", "5.knit"), dataset, record)
    code = f"""
import sys
import tsuya
btf = tsuya.load("neural_btf/compressed_btf/5.knit", {str(root)!r})
print(btf.texels, *(name in sys.modules for name in ("torch", "numba", "dagster")))
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["48", "False", "False", "False"]
