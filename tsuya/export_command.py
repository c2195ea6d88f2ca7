"""``tsuya export``: packages as files for other programs."""

from __future__ import annotations

import shutil
import uuid
from collections.abc import Callable, Sequence
from pathlib import Path

from assets_defs.workspace import Workspace
from storage.packages import Package
from storage.slugs import slug
from tsuya.exports import Format, find_format, formats
from tsuya.exports.format import Notes
from tsuya.packages import SUFFIX, find_package, package_slots


def export(
    workspace: Workspace, keys: Sequence[str], name: str, out: Path | None
) -> list[tuple[Path, Notes]]:
    """Write packages in a format; returns each path with what the format does not hold.

    Without keys all packages of the store, for a format that holds several. ``out``: a path for one
    result; by default ``exports/<system>/`` beside the data. What is there is replaced once the new
    one is whole. Raises ValueError, BadInput, NoVersionError.
    """
    packages = [find_package(workspace.store, key) for key in keys or _all_keys(workspace)]
    chosen = [find_format(name, package.system) for package in packages]
    if not packages:
        raise ValueError("the store holds no package; expected a KEY, or run `tsuya demo` before.")
    together = chosen[0].together
    if together is not None and (len(packages) > 1 or not keys):
        target = out or workspace.exports / name
        return [(target, _replaced(target, lambda path: together(packages, path)))]
    if len(packages) > 1 and out is not None:
        raise ValueError("--out is one path for several keys; expected one KEY, or no --out.")
    if not keys:
        raise ValueError(f"--to {name} takes one package; expected a KEY.")
    return [
        _written(package, form, out or _target(workspace, package, form))
        for package, form in zip(packages, chosen, strict=True)
    ]


def format_lines(system: str | None) -> list[str]:
    """What there is, a line a format."""
    return [
        f"{form.name:12} {form.meaning}" + ("" if system else f" ({', '.join(form.systems)})")
        for form in formats(system)
    ]


def _all_keys(workspace: Workspace) -> list[str]:
    return [str(slot) for slot in package_slots(workspace.store)]


def _target(workspace: Workspace, package: Package, form: Format) -> Path:
    stem = slug(Path(package.name).name.removesuffix(SUFFIX))
    folder = "" if form.ending else f"-{form.name}"
    return workspace.exports / package.system / f"{stem}{folder}{form.ending}"


def _written(package: Package, form: Format, target: Path) -> tuple[Path, Notes]:
    return target, _replaced(target, lambda path: form.write(package, path))


def _replaced(target: Path, write: Callable[[Path], Notes]) -> Notes:
    """Write aside, then put it in the place of what is there."""
    target.parent.mkdir(parents=True, exist_ok=True)
    beside = target.with_name(f".{uuid.uuid4().hex[:8]}-{target.name}")
    try:
        notes = write(beside)
        if target.is_dir() and not target.is_symlink():
            shutil.rmtree(target)
        beside.replace(target)
    finally:
        if beside.is_dir():
            shutil.rmtree(beside)
        beside.unlink(missing_ok=True)
    return notes
