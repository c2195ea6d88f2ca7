"""What judges forms and rivals of a BTF."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.btf_judging import Judge, judge_of
from pipelines.light.directions import all_pairs, hemisphere_table


@pytest.fixture(scope="module")
def judge() -> Judge:
    table = hemisphere_table(81)
    values = np.random.default_rng(0).random((64, 6561, 3)).astype(np.float16)
    return judge_of(values, all_pairs(table, table), (8, 8), 1.0)


def test_every_view_and_every_light_takes_part(judge: Judge) -> None:
    for number in (judge.chosen % 81, judge.chosen // 81):
        assert np.bincount(number, minlength=81).min() >= 11


def test_few_photographs_are_all_judged() -> None:
    table = hemisphere_table(15)
    judge = judge_of(np.zeros((4, 225, 3)), all_pairs(table, table), (2, 2), 1.0)
    assert judge.chosen.tolist() == list(range(225))


def test_what_is_right_has_no_error_and_mean_colours_have_the_nulls(judge: Judge) -> None:
    seen = judge.abrdfs[:, judge.chosen].astype(np.float32)
    right = judge.figures(lambda first, last: seen[first:last])
    assert right["rmse"] == 0.0
    assert right["flip"] == 0.0
    assert right["grazing_detail"] == pytest.approx(1.0)
    flat = np.broadcast_to(seen.mean(axis=0), seen.shape)
    null = judge.figures(lambda first, last: flat[first:last])
    assert null["rmse"] == pytest.approx(seen.std(axis=0).mean(), rel=0.01)
    assert null["rmse_over_null"] == pytest.approx(1.0, abs=1e-3)
    assert null["flip"] > 0.3
    assert null["grazing_detail"] == pytest.approx(0.0, abs=1e-6)
