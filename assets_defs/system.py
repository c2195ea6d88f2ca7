"""What a system is made of: dimensions, assets with their checks, defaults.

A system module declares one ``System`` and decorates plain functions with ``system.asset``. The
function gets its inputs as lazy datasets by name and returns a dataset with metadata; everything
around it (partitions, settings, provenance, checks, retries, errors) is done here, once.
"""

from __future__ import annotations

import functools
import hashlib
import inspect
import itertools
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import dagster as dg

from assets_defs.checks import Check, build_check
from assets_defs.code_version import code_version
from assets_defs.memory import give_back_freed_memory
from assets_defs.pictures import thumbnail
from assets_defs.settings import Settings, config_class, resolve
from assets_defs.workspace import Workspace
from storage.errors import SchemaError
from storage.io_manager import INTERRUPTED
from storage.schemas import Schema
from storage.slugs import slug
from storage.versions import WHOLE, Slot, VersionedStore
from storage.zarr_files import RECORD

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr
    from numpy.typing import NDArray

Metadata = Mapping[str, Any]
Pictures = Callable[["xr.Dataset"], "Mapping[str, NDArray[np.uint8]]"]
"""Pictures (y, x, 3) of a dataset by name, for the web UI and the gallery."""
Overview = Callable[[VersionedStore, Sequence[Slot]], "Mapping[str, NDArray[np.uint8]]"]
"""Pictures (y, x, 3), or moving ones (frame, y, x, 3), by name, of the slots that have some."""
Progress = Callable[[str, float], None]
"""Told what is being done and the fraction that is done."""

RETRIES = dg.RetryPolicy(max_retries=2, delay=1)
OWNERS = ("team:tsuya",)


@dataclass(frozen=True)
class Source:
    """What a partition's first asset is made from: a user's file, or something built in."""

    key: str
    path: Path | None

    @classmethod
    def of(cls, path: Path) -> Source:
        """A file or a folder; its ending is part of the key: `fur.png`, `fur.jpg` are two."""
        if path.is_dir():
            return cls(slug(f"{path.name}-folder"), path)
        return cls(slug(f"{path.stem}-{path.suffix[1:]}"), path)

    @property
    def name(self) -> str:
        """The name that people know it by."""
        return self.key if self.path is None else self.path.name

    @property
    def fingerprint(self) -> str:
        """Hash of the file's bytes, or of all files in the folder; of a built-in item, its key."""
        if self.path is None:
            return f"built-in:{self.key}"
        if self.path.is_dir():
            inside = sorted(path for path in self.path.rglob("*") if path.is_file())
            return _hash(
                [[str(p.relative_to(self.path)), Source("", p).fingerprint] for p in inside]
            )
        with self.path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()


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
    """What the launcher and the decorator know of one asset."""

    schema: Schema
    by: tuple[str, ...]
    settings: type[Settings]
    inputs: tuple[str, ...]
    from_source: bool
    checks: tuple[Check, ...]
    pictures: Pictures | None
    code: str

    @property
    def name(self) -> str:
        """The asset's name inside its system."""
        return self.schema.asset


@dataclass
class System:
    """One system: a group of assets in the graph."""

    name: str
    title: str
    dimensions: tuple[Dimension, ...]
    check: Callable[[Mapping[str, Source], Mapping[str, Settings]], object] | None = None
    """Raises ValueError for sources, by dimension, that cannot go together with these settings, by
    asset. Asked before any work."""
    overview: Overview | None = None
    """Pictures of several partitions together, for the gallery."""
    plans: dict[str, AssetPlan] = field(default_factory=dict)
    """In the order of declaration: inputs come before what is made from them."""
    assets: list[dg.AssetsDefinition] = field(default_factory=list)
    asset_checks: list[dg.AssetChecksDefinition] = field(default_factory=list)

    # ---- partitions and sources --------------------------------------------------------------

    def dimension(self, name: str) -> Dimension:
        """A dimension by its name."""
        return next(dimension for dimension in self.dimensions if dimension.name == name)

    def dynamic(self, dimension: str) -> dg.DynamicPartitionsDefinition:
        """Dagster's partitions of one dimension; their name is unique among all systems."""
        return dg.DynamicPartitionsDefinition(name=f"{self.name}_{dimension}")

    def partitions(self, by: Sequence[str]) -> dg.PartitionsDefinition[str]:
        """Dagster's partitions of a grain."""
        if len(by) == 1:
            return self.dynamic(by[0])
        return dg.MultiPartitionsDefinition({name: self.dynamic(name) for name in by})

    def grains(self) -> list[tuple[str, ...]]:
        """The different partitionings, in an order in which they can be run."""
        return list(dict.fromkeys(plan.by for plan in self.plans.values()))

    def job_name(self, by: Sequence[str]) -> str:
        """Name of the job that runs a grain."""
        return "_".join((self.name, *by))

    def sources(self, dimension: str, inbox: Path) -> dict[str, Source]:
        """Everything that a dimension has: built-in items and files in the inbox, by key."""
        builtin = {key: Source(key, None) for key in self.dimension(dimension).builtin}
        dropped = (Source.of(path) for path in self.files(dimension, inbox))
        return builtin | {source.key: source for source in dropped}

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
        declared = self.dimension(dimension)
        if not inbox.is_dir():
            return []
        return sorted(
            path
            for path in inbox.iterdir()
            if path.suffix.lower() in declared.suffixes
            or (declared.folders and path.is_dir() and not path.name.startswith("."))
        )

    def span(self, wanted: Mapping[str, Sequence[str]]) -> list[dict[str, str]]:
        """The cross product of keys by dimension."""
        names = list(wanted)
        return [dict(zip(names, keys, strict=True)) for keys in itertools.product(*wanted.values())]

    def made(self, workspace: Workspace) -> list[dict[str, str]]:
        """Every partition that was made and whose sources are still there, as keys by dimension."""
        inbox = workspace.inbox(self.name)
        known = {
            dimension.name: set(self.sources(dimension.name, inbox))
            for dimension in self.dimensions
        }
        found = []
        for slot in workspace.store.slots():
            if slot.system == self.name and slot.asset in self.plans:
                by = sorted(self.plans[slot.asset].by)
                keys = dict(zip(by, slot.partition.split("."), strict=True))
                if all(
                    key in known[name] or self.dimension(name).needs_no_file(key)
                    for name, key in keys.items()
                ):
                    found.append(keys)
        return found

    def examples(self) -> list[dict[str, str]]:
        """The partitions that the demo shows."""
        return self.span({dimension.name: dimension.examples for dimension in self.dimensions})

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
        has_current = store.pointer(slot).version is not None
        return resolve(
            self.plans[asset].settings,
            asset,
            keys,
            preset=preset,
            given=given,
            current=store.record(slot)["settings"] if has_current else None,
        )

    def source_of(self, plan: AssetPlan, keys: Mapping[str, str], inbox: Path) -> Source | None:
        """The source of an asset that has one. Raises ValueError where it is gone."""
        if not plan.from_source:
            return None
        (dimension,) = plan.by
        return self.source(dimension, keys[dimension], inbox)

    # ---- assets ------------------------------------------------------------------------------

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
        pictures: Pictures | None = None,
    ) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
        """Declare an asset; the decorated function stays callable by itself.

        It is called with ``settings``, then whichever it names of ``source`` (for an asset made
        from one), ``keys`` (the partition), ``progress`` (a function of the fraction done),
        ``work`` (where state is kept that outlives a killed process) and its inputs, and returns
        ``(dataset, metadata)``.
        """

        def declare(function: Callable[..., Any]) -> Callable[..., Any]:
            figures = [check.figure for check in checks]
            plan = AssetPlan(
                schema,
                by,
                settings,
                inputs,
                from_source,
                checks,
                pictures,
                code_version(function, *figures),
            )
            self.plans[plan.name] = plan
            asset = self._dagster_asset(plan, function, kinds)
            self.assets.append(asset)
            for check in checks:
                self.asset_checks.append(build_check(check, asset, self._slot_of(plan)))
            return function

        return declare

    def _slot_of(self, plan: AssetPlan) -> Callable[[Any], Slot]:
        return lambda context: self.slot(plan.name, partition_keys(context, plan.by))

    def _dagster_asset(
        self, plan: AssetPlan, function: Callable[..., Any], kinds: frozenset[str]
    ) -> dg.AssetsDefinition:
        def compute(context, config, **inputs):  # type: ignore[no-untyped-def]
            return self._materialise(plan, function, context, config, inputs)

        compute.__annotations__ = {
            "context": dg.AssetExecutionContext,
            "config": config_class(plan.settings),
        }
        return dg.asset(
            compute,
            key=[self.name, plan.name],
            ins={name: dg.AssetIn(key=[self.name, name]) for name in plan.inputs},
            partitions_def=self.partitions(plan.by),
            group_name=self.name,
            kinds=set(kinds),
            owners=list(OWNERS),
            description=f"{plan.schema.meaning}\n\n{plan.schema.markdown()}",
            metadata={
                "dagster/column_schema": dg.TableSchema(
                    columns=[
                        dg.TableColumn(name, variable.dtype, variable.meaning)
                        for name, variable in plan.schema.variables.items()
                    ]
                ),
                "schema number": plan.schema.number,
            },
            code_version=plan.code,
            retry_policy=RETRIES,
            required_resource_keys={"workspace", "progress"},
            io_manager_key="io_manager",
        )

    def _materialise(
        self,
        plan: AssetPlan,
        function: Callable[..., Any],
        context: dg.AssetExecutionContext,
        config: dg.Config,
        inputs: dict[str, xr.Dataset],
    ) -> dg.Output[xr.Dataset]:
        keys = partition_keys(context, plan.by)
        given = {name: value for name, value in config.model_dump().items() if value is not None}
        preset = given.pop("preset", None)
        try:
            workspace: Workspace = context.resources.workspace
            settings = self.resolve(plan.name, keys, workspace.store, preset=preset, given=given)
            source = self.source_of(plan, keys, workspace.inbox(self.name))
            what = f"{plan.name} [{', '.join(keys.values())}]"
            progress = functools.partial(context.resources.progress, what)
            progress(0.0)
            give_back_freed_memory()
            records = {name: data.attrs[RECORD] for name, data in inputs.items()}
            fingerprint = source.fingerprint if source else None
            made_of = provenance(plan, settings, fingerprint, records)
            offered = {
                "settings": settings,
                "source": source,
                "keys": keys,
                "progress": progress,
                "work": workspace.store.work(self.slot(plan.name, keys), made_of["recipe"]),
                **inputs,
            }
            named = inspect.signature(function).parameters
            dataset, metadata = function(**{name: offered[name] for name in named})
            shown = plan.pictures(dataset) if plan.pictures else {}
        except (KeyboardInterrupt, dg.DagsterExecutionInterruptedError) as stop:
            # Left to itself, Dagster would take the interruption for trouble and try again.
            raise dg.Failure(description=INTERRUPTED, allow_retries=False) from stop
        except (ValueError, SchemaError) as error:
            # What the user gave cannot work: a second try would not either.
            raise dg.Failure(description=str(error), allow_retries=False) from error
        record = made_of | {
            "run": context.run.run_id,
            "checks": [check.name for check in plan.checks],
        }
        thumbnails = {name: thumbnail(picture) for name, picture in shown.items()}
        return dg.Output(
            dataset.assign_attrs({RECORD: record}), metadata={**thumbnails, **metadata}
        )


def provenance(
    plan: AssetPlan,
    settings: Settings,
    source: str | None,
    inputs: Mapping[str, Mapping[str, Any]],
) -> dict[str, Any]:
    """The part of a version's record that says what it was made of.

    ``recipe`` is the hash of code, settings, source and the inputs' content: the launcher skips
    what has it already. ``lineage`` leaves out code and content: versions of equal lineage were
    asked for in the same way, so their figures may be compared.
    """
    stored = settings.model_dump(mode="json")
    chosen = dict(stored)
    files = {name: Source("", path).fingerprint for name, path in settings.files().items()}
    if files:
        chosen |= {"files": files}
    contents = {name: record["content"] for name, record in inputs.items()}
    lineages = {name: record["lineage"] for name, record in inputs.items()}
    return {
        "asset": f"{plan.schema.system}/{plan.name}",
        "schema": plan.schema.number,
        "settings": stored,
        "source": source,
        "code": plan.code,
        "inputs": [
            {
                "asset": name,
                "partition": record["partition"],
                "version": record["version"],
                "content": record["content"],
            }
            for name, record in inputs.items()
        ],
        "recipe": _hash(plan.schema.number, plan.code, chosen, source, contents),
        "lineage": _hash(chosen, source, lineages),
    }


def _hash(*parts: Any) -> str:
    return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()


def partition_folder(keys: Mapping[str, str]) -> str:
    """Folder name of a partition: keys in the order of their dimensions' names."""
    return ".".join(keys[name] for name in sorted(keys)) or WHOLE


def partition_key(keys: Mapping[str, str]) -> str:
    """Dagster's partition key: keys in the order of their dimensions' names."""
    return "|".join(keys[name] for name in sorted(keys))


def partition_keys(context: Any, by: Sequence[str]) -> dict[str, str]:
    """The keys of a run's partition by dimension."""
    return dict(zip(sorted(by), context.partition_key.split("|"), strict=True))
