"""Make docs/btf_figures.md of the committed figures of paper-size BTFs: ``make docs``."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

from benchmarks import btf_paper_training
from benchmarks.btf_columns import COLUMNS, FILE, committed_columns
from benchmarks.btf_material import NULLS
from benchmarks.btf_paper_scale import HEADLINES, MATERIALS, RUNS, committed_figures, result_path

PAGE = Path(__file__).parent / "btf_figures.md"
_PAPERS = {
    "fabric02": (0.0203, 0.0212, 0.0200, 0.0203),
    "WOOL": (0.0264, 0.0275, 0.0274, 0.0274),
    "CORDUROY": (0.0285, 0.0289, 0.0282, 0.0288),
    "PULLI": (0.0337, 0.0346, 0.0340, 0.0340),
}
"""The BTF paper's table 2."""
_PAPERS_CROPS = {
    "fabric02": ((0.0182, 0.0173, 0.0198), (0.0244, 0.0242, 0.0242)),
    "WOOL": ((0.0276, 0.0225, 0.0236), (0.0275, 0.0274, 0.0274)),
    "CORDUROY": ((0.0288, 0.0355, 0.0286), (0.0408, 0.0340, 0.0239)),
    "PULLI": ((0.0257, 0.0275, 0.0215), (0.0404, 0.0486, 0.0295)),
}
"""Its tables 3 and 4: dark and bright crops."""

_INTRODUCTION = """# Figures of paper-size BTFs

Made by `make docs` from `benchmarks/results/`, which `python -m benchmarks btf --scale paper` and
`python -m benchmarks btf_paper_training --scale paper` write, a file a run, each with its commit
and machine. [What they are of](btf.md) comes first.

Virtual cloths of 100 x 100 texels, 81 x 81 photographs, 16 rays a texel, nulls in italics. Networks
are trained with `training=fast` where nothing else is said."""

_HEADLINES = """
## In one table

Ratios are of RMSE where nothing else is said, over 960 photographs, the same for each form
and rival.

- `rival`: the file over the best rival at its bytes; `rival_by_texel`: over the best that gives a
  texel without decoding all; `null`: a colour a photograph, which is the mean ABRDF, over the file.
- `none_rmse_gain`: today's float32 network over that of the first version, both of 4 rays a texel.
- `mip_error_ratio`: coarser levels over averaged near views, all levels together.
- `grazing_detail`: gradients restored in views of 60 degrees and more; `grazing_energy`: their
  energy, right or not, in all photographs.
"""
_RATIOS = ("rmse_over_deviation", "rmse_over_null_60", "worst_photographs")
_ROWS = """
## Forms and rivals

Bytes are of the file as it is written, memory of arrays as they run, in float32. RMSE is over
alpha, the same over the deviation of all values; of views of 60 degrees and more over that of the
mean ABRDF; of the worst tenth of photographs over the deviation. PSNR, SSIM and FLIP are of
tone-mapped photographs. Million lookups a second, at places between texels, were measured beside
other work.
"""
_COLUMNS = (
    *("", "bytes", "memory", "Mlookups/s", "RMSE", "over deviation", "at 60°", "worst"),
    *("PSNR", "SSIM", "FLIP", "grazing detail"),
)


def figures_page() -> str:
    """The page."""
    paths = {run: result_path(*run) for run in RUNS}
    runs = {run: json.loads(path.read_text()) for run, path in paths.items() if path.exists()}
    lines = [_INTRODUCTION, _HEADLINES, *_headlines()]
    columns = committed_columns(MATERIALS)
    lines += _tables(columns) if columns else []
    lines += _training()
    lines += [_ROWS.rstrip()]
    for (material, seed), found in runs.items():
        lines += [f"\n### {material.capitalize()}, seed {seed}\n", *_head(_COLUMNS)]
        lines += [_form_row(name, row) for name, row in found["forms"].items()]
        rivals = sorted(found["rivals"].items(), key=lambda rival: float(rival[1]["rmse"]))
        lines += [_form_row(_rival_name(*rival), rival[1]) for rival in rivals]
    return "\n".join(lines) + "\n"


def _headlines() -> Iterable[str]:
    told = committed_figures()
    names = list(told["file_bytes_each"])
    yield from _head(["", "mean of seed 0", *names])
    for name in HEADLINES:
        each = told[f"{name}_each"]
        yield _row(f"`{name}`", [told[name], *(each[run] for run in names)], _number)


def _tables(columns: dict[str, Any]) -> Iterable[str]:
    shown = ("none", *COLUMNS, FILE)
    yield "\n## Table 2: RMSE over all photographs, values over alpha\n"
    yield from _head(["", "none", *(f"k = {column}" for column in COLUMNS), "the file"])
    for material, found in columns.items():
        yield _row(material, [found["rmse"][name] for name in shown], "{:.4f}".format)
    for material, values in _PAPERS.items():
        yield _row(f"*{material}, the paper's*", [*values, None], "{:.4f}".format)
    yield _row("bytes", [columns[next(iter(columns))]["bytes"][name] for name in shown], _bytes)
    yield (
        "\nThe materials are not the paper's, so its rows are neighbours, not rivals. Texels of a "
        "cluster are replaced by their mean in this training: their representative has no effect. "
        "Only none and the file look latents up by the view."
    )
    yield "\n## Tables 3 and 4: RMSE of the draped cloth's crops, to that of the network\n"
    shown = (*COLUMNS, FILE)
    kinds = [f"{crop} {name}" for crop in ("dark", "bright") for name in shown]
    yield from _head(["", *kinds, "whole file", "whole file to measured"])
    for material, found in columns.items():
        errors = found["cloth_rmse_to_none"]
        values = [errors[name][crop] for crop in ("dark", "bright") for name in shown]
        values += [errors[FILE]["whole"], found["cloth_rmse_to_raw"][FILE]["whole"]]
        yield _row(material, values, "{:.4f}".format)
    for material, (dark, bright) in _PAPERS_CROPS.items():
        papers = [*dark, None, *bright, None, None, None]
        yield _row(f"*{material}, the paper's*", papers, "{:.4f}".format)


def _training() -> Iterable[str]:
    told = btf_paper_training.committed_figures()
    if not told["rmse"]:
        return
    yield "\n## `training=paper` against the clock\n"
    yield (
        "Knit, RMSE over alpha of all photographs. The name says clusters, what is trained "
        "(`texels` or clusters' `representatives`), what represents a cluster, and processor "
        "seconds (and 41 directions in place of 81); mean and half of a 95 % interval over seeds.\n"
    )
    yield from _head(["run", "RMSE", "±", "seeds", "*a colour a photograph*"])
    for name, found in told["rmse"].items():
        null = told["rmse_null"][name]["mean"]
        values = [found["mean"], found["half_interval"], found["seeds"], null]
        yield _row(f"`{name}`", values, _number)


def _head(names: Sequence[str]) -> list[str]:
    return [f"| {' | '.join(names)} |", "|---" * len(names) + "|"]


def _row(name: str, values: Sequence[Any], shown: Callable[[Any], str]) -> str:
    cells = ["–" if value is None else shown(value) for value in values]
    return f"| {name} | {' | '.join(cells)} |"


def _form_row(name: str, row: dict[str, Any]) -> str:
    memory, speed = row.get("memory_bytes"), row.get("decode_mlookups_s")
    cells = [
        *(_bytes(row["bytes"]), "–" if memory is None else _bytes(memory)),
        *("–" if speed is None else f"{speed:.2f}", f"{row['rmse']:.4f}"),
        *(f"{row[key]:.3f}" for key in _RATIOS),
        *(f"{row['psnr']:.2f}", f"{row['ssim']:.3f}", f"{row['flip']:.3f}"),
        f"{row['grazing_detail']:.3f}",
    ]
    return f"| {name} | {' | '.join(cells)} |"


def _rival_name(name: str, row: dict[str, Any]) -> str:
    what = name.replace("_", " ")
    if name in NULLS:
        return f"*{what}*"
    return f"rival: {what}" if row["by_texel"] else f"rival: {what}, no single texel"


def _bytes(count: int) -> str:
    return f"{count:,}".replace(",", " ")


def _number(value: float) -> str:
    if isinstance(value, int) or value == round(value) or value > 1000:
        return _bytes(round(value))
    return f"{value:.3g}" if value < 0.01 else f"{value:.4f}" if value < 0.1 else f"{value:.3f}"


if __name__ == "__main__":
    PAGE.write_text(figures_page())
