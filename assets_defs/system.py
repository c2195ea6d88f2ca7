"""What a system declares: dimensions, assets with their settings and checks, defaults.

A system has one ``System`` and decorates plain functions with ``system.asset``. The function gets
its inputs as lazy datasets by name and returns a dataset with metadata; what is around it
(partitions, provenance, retries, errors, the web UI) is made of the declaration in
``dagster_assets``. Nothing here or in a system's modules imports Dagster: the command line's help
and a notebook read declarations, too.
"""

from __future__ import annotations

import functools
import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from assets_defs.checks import Check
from assets_defs.code_version import code_version
from assets_defs.partitions import keys_of_partition, partition_folder
from assets_defs.settings import Settings, resolve
from assets_defs.sources import Found, Source, by_key, look_into
from assets_defs.workspace import Workspace
from storage.schemas import Schema
from storage.versions import Slot, VersionedStore

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr
    from numpy.typing import NDArray

Metadata = Mapping[str, Any]
"""For the web UI: numbers, texts; rows of equal columns, a list of dicts, become a table, a picture
(y, x) or (y, x, 3) of 8 bits a thumbnail. ``NOTES`` is for people wherever they look."""
NOTES = "notes"
"""Of an asset's metadata: sentences on what was converted, mended or left out of a user's file.
They stay with the version, and the command line prints them."""
Result = tuple["xr.Dataset", Metadata]
"""What an asset's function returns."""
Pictures = Mapping[str, "NDArray[np.uint8]"]
"""Pictures (y, x, 3), or moving ones (frame, y, x, 3), by name."""
Progress = Callable[[float], None]
"""Told the fraction of an asset's work that is done."""
BeforeWork = Callable[[Mapping[str, Source], Mapping[str, Settings]], object]
"""Raises ValueError for sources, by dimension, that cannot go together with these settings, by
asset."""


@dataclass(frozen=True)
class Dimension:
    """What a system's assets are partitioned by: its photographs, its meshes …"""

    name: str
    builtin: tuple[str, ...]
    """Keys that need no file."""
    examples: tuple[str, ...]
    """The built-in ones that the demo shows, and that are made where nothing is asked for."""
    default: str
    """What a dropped item of another dimension is combined with."""
    suffixes: tuple[str, ...]
    """Endings of this dimension's files in the inbox, lower case."""
    check: Callable[[Source, Mapping[str, Any]], object]
    """Raises ValueError for a source that cannot be used with these settings of its asset."""
    folders: bool = False
    """Whether a folder in the inbox is an item, too."""
    numbers: bool = False
    """Whether every positive whole number is a key that needs no file."""

    def needs_no_file(self, key: str) -> bool:
        """Whether a key is built in, or a number where numbers are keys."""
        is_number = key.isdecimal() and key == str(int(key)) and int(key) > 0
        return key in self.builtin or (self.numbers and is_number)


@dataclass(frozen=True)
class AssetPlan:
    """One asset as it is declared."""

    schema: Schema
    function: Callable[..., Any]
    by: tuple[str, ...]
    settings: type[Settings]
    inputs: tuple[str, ...]
    from_source: bool
    kinds: frozenset[str]
    checks: tuple[Check, ...]
    pictures: Callable[[xr.Dataset], Pictures] | None
    """What it shows of itself, in the web UI and in the gallery."""

    @property
    def name(self) -> str:
        """The asset's name inside its system."""
        return self.schema.asset

    @functools.cached_property
    def code(self) -> str:
        """Hash of the code of the asset and of its checks' figures."""
        return code_version(self.function, *(check.figure for check in self.checks))


@dataclass(eq=False)
class System:
    """One system: a group of assets in the graph."""

    name: str
    title: str
    dimensions: tuple[Dimension, ...]
    overview: Callable[[VersionedStore, Sequence[Slot]], Pictures] | None = None
    """Pictures of several partitions together, for the gallery; of the slots that have some."""
    plans: dict[str, AssetPlan] = field(default_factory=dict)
    """In the order of declaration: inputs come before what is made from them."""
    asked_before_work: list[BeforeWork] = field(default_factory=list)

    # ---- declaring ---------------------------------------------------------------------------

    def asset(
        self,
        schema: Schema,
        *,
        by: tuple[str, ...],
        settings: type[Settings],
        inputs: tuple[str, ...] = (),
        from_source: bool = False,
        kinds: frozenset[str] = frozenset({"zarr"}),
        checks: tuple[Check, ...] = (),
        pictures: Callable[[xr.Dataset], Pictures] | None = None,
    ) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
        """Declare an asset; the decorated function stays callable by itself.

        It is called with ``settings``, then whichever it names of ``source`` (for an asset made
        from one), ``keys`` (the partition), ``progress`` (a function of the fraction done),
        ``work`` (where state is kept that outlives a killed process), ``lineage`` (all versions
        that its inputs were made of, with their verdicts) and its inputs, and returns
        ``(dataset, metadata)``.
        """

        def declare(function: Callable[..., Any]) -> Callable[..., Any]:
            plan = AssetPlan(
                schema, function, by, settings, inputs, from_source, kinds, checks, pictures
            )
            self.plans[plan.name] = plan
            return function

        return declare

    def before_work(self, function: BeforeWork) -> BeforeWork:
        """Declare what is to be asked of a request's sources and settings before any work."""
        self.asked_before_work.append(function)
        return function

    # ---- partitions and sources --------------------------------------------------------------

    def dimension(self, name: str) -> Dimension:
        """A dimension by its name."""
        return next(dimension for dimension in self.dimensions if dimension.name == name)

    def partitions_name(self, dimension: str) -> str:
        """Name of one dimension's dynamic partitions, unique among all systems."""
        return f"{self.name}_{dimension}"

    def grains(self) -> list[tuple[str, ...]]:
        """The different partitionings, in an order in which they can be run."""
        return list(dict.fromkeys(plan.by for plan in self.plans.values()))

    def job_name(self, by: Sequence[str]) -> str:
        """Name of the job that runs a grain."""
        return "_".join((self.name, *by))

    def sources(self, dimension: str, inbox: Path) -> dict[str, Source]:
        """Everything that a dimension has: built-in items and files in the inbox, by key."""
        builtin = {key: Source(key, None) for key in self.dimension(dimension).builtin}
        return builtin | by_key(self.files(dimension, inbox))

    def source(self, dimension: str, key: str, inbox: Path) -> Source:
        """The source that a key names. Raises ValueError where there is none."""
        sources = self.sources(dimension, inbox)
        if key in sources:
            return sources[key]
        declared = self.dimension(dimension)
        if declared.needs_no_file(key):
            return Source(key, None)
        number = ", or a whole number" if declared.numbers else ""
        raise ValueError(
            f"{dimension} {key!r} is not known; expected one of {', '.join(sources)}{number}."
        )

    def files(self, dimension: str, inbox: Path) -> list[Path]:
        """The dimension's files, or folders, in the inbox."""
        return self.found(inbox).items[dimension]

    def found(self, inbox: Path) -> Found:
        """What lies in the inbox: items of all dimensions, and what is none."""
        endings = {dimension.name: dimension.suffixes for dimension in self.dimensions}
        folders = [dimension.name for dimension in self.dimensions if dimension.folders]
        return look_into(inbox, endings, folders)

    def cross_product(self, wanted: Mapping[str, Sequence[str]]) -> list[dict[str, str]]:
        """The cross product of keys by dimension."""
        names = list(wanted)
        return [dict(zip(names, keys, strict=True)) for keys in itertools.product(*wanted.values())]

    def stored_partitions(self, workspace: Workspace) -> list[dict[str, str]]:
        """Every partition that was made and whose sources are still there, as keys by dimension."""
        inbox = workspace.inbox(self.name)
        known = {
            dimension.name: set(self.sources(dimension.name, inbox))
            for dimension in self.dimensions
        }
        found = []
        for slot in workspace.store.slots():
            if slot.system == self.name and slot.asset in self.plans:
                by = self.plans[slot.asset].by
                keys = keys_of_partition(slot.partition, by, separator=".")
                if all(
                    key in known[name] or self.dimension(name).needs_no_file(key)
                    for name, key in keys.items()
                ):
                    found.append(keys)
        return found

    def is_made_of(self, slot: Slot, dimension: str, key: str) -> bool:
        """Whether what is stored there is made of one item, of it alone or with others."""
        plan = self.plans.get(slot.asset) if slot.system == self.name else None
        if plan is None or dimension not in plan.by:
            return False
        keys = slot.partition.split(".")
        return len(keys) == len(plan.by) and keys[sorted(plan.by).index(dimension)] == key

    def examples(self) -> list[dict[str, str]]:
        """The partitions that the demo shows."""
        return self.cross_product(
            {dimension.name: dimension.examples for dimension in self.dimensions}
        )

    def slot(self, asset: str, keys: Mapping[str, str]) -> Slot:
        """Where an asset's partition is stored; several keys are joined in the order of names."""
        return Slot(self.name, asset, partition_folder(keys))

    # ---- provenance --------------------------------------------------------------------------

    def resolve(
        self,
        asset: str,
        keys: Mapping[str, str],
        store: VersionedStore,
        *,
        preset: str | None,
        given: Mapping[str, Any],
    ) -> Settings:
        """An asset's settings for a partition. Raises SettingsError."""
        slot = self.slot(asset, keys)
        pointer = store.pointer(slot)
        return resolve(
            self.plans[asset].settings,
            asset,
            keys,
            preset=preset,
            given=given,
            current=store.record(slot)["settings"] if pointer.version else pointer.settings,
        )

    def source_of(self, plan: AssetPlan, keys: Mapping[str, str], inbox: Path) -> Source | None:
        """The source of an asset that has one. Raises ValueError where it is gone."""
        if not plan.from_source:
            return None
        (dimension,) = plan.by
        return self.source(dimension, keys[dimension], inbox)
