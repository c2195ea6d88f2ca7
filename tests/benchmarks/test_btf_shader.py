"""The figure for the shader is small where it is right, and moves where it is not."""

from __future__ import annotations

from assets_defs.neural_btf.datasets import runtime_btf
from benchmarks.btf_shader import shader_figures
from tests.btf_packages import random_file


def test_the_shader_is_near_numpy_and_other_texels_are_not() -> None:
    figures = shader_figures(runtime_btf(random_file(size=(12, 16), channels=24)), (48, 36))
    assert figures["shader_vs_numpy_rmse"] < 0.1 / 255
    assert figures["student_shader_vs_numpy_rmse"] < 0.1 / 255
    assert figures["shader_vs_numpy_null_rmse"] > 10 / 255


def test_the_null_moves_where_only_coarser_levels_are_seen() -> None:
    btf = runtime_btf(random_file(size=(64, 64), channels=8))
    assert btf.mips
    figures = shader_figures(btf, (24, 18))
    assert figures["shader_vs_numpy_null_rmse"] > 10 / 255
