"""What a launch and a store say to a person: tables, and the same as JSON."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

from rich.table import Table

from storage.errors import DamagedError
from storage.versions import Slot, VersionedStore
from storage.zarr_files import stored_bytes

if TYPE_CHECKING:
    from assets_defs.launcher import Outcome
    from assets_defs.system import System


def slot_report(store: VersionedStore, slot: Slot) -> dict[str, Any]:
    """A slot's current version with its figures; what waits, was rejected and why, is damaged."""
    pointer = store.pointer(slot)
    report: dict[str, Any] = {
        "key": str(slot),
        "version": pointer.version,
        "earlier": len(pointer.earlier),
        "unchecked": len(pointer.candidates),
        "rejected": [
            {"version": version, "check": check, "reason": verdict["reason"]}
            for version in store.versions(slot)
            for check, verdict in store.verdicts(slot, version).items()
            if not verdict["passed"]
        ],
        "damaged": store.files(slot).damage(),
    }
    if pointer.version is not None:
        try:
            record = store.record(slot)
        except DamagedError:
            return report  # said above
        report |= {
            "created": record["created"],
            "settings": record["settings"],
            "notes": record.get("notes", []),  # none in versions of before
            "bytes": stored_bytes(store.folder(slot)),
            "figures": {
                check: verdict["figure"]
                for check, verdict in store.verdicts(slot, pointer.version).items()
                if verdict["figure"] is not None
            },
        }
    return report


def file_notes(reports: Sequence[dict[str, Any]]) -> list[str]:
    """What was converted, mended or left out of users' files: a line each."""
    return [f"{report['key']}: {note}" for report in reports for note in report.get("notes", ())]


def outcome_reports(store: VersionedStore, outcomes: Sequence[Outcome]) -> list[dict[str, Any]]:
    """Each outcome with the report of its slot."""
    return [
        {"state": outcome.state, "seconds": round(outcome.seconds, 3)}
        | slot_report(store, outcome.slot)
        for outcome in outcomes
    ]


def figures_table(systems: Iterable[System], reports: Sequence[dict[str, Any]]) -> Table:
    """One row a check: on how many partitions, between which figures, within which bounds."""
    table = Table(title="Figures of the checks", title_justify="left")
    for name, justify in (
        ("asset", "left"), ("check", "left"), ("on", "right"), ("least", "right"),
        ("most", "right"), ("bounds", "left"),
    ):  # fmt: skip
        table.add_column(name, justify=justify)  # type: ignore[arg-type]
    for system in systems:
        for plan in system.plans.values():
            found = [report for report in reports if _is_of(report, system.name, plan.name)]
            for check in plan.checks:
                figures = [
                    report["figures"][check.name]
                    for report in found
                    if check.name in report.get("figures", {})
                ]
                if figures:
                    low, high = f"{min(figures):.4g}", f"{max(figures):.4g}"
                    row = (plan.name, check.name, str(len(figures)), low, high, check.bounds())
                    table.add_row(*row)
    return table


def sizes_table(systems: Iterable[System], reports: Sequence[dict[str, Any]]) -> Table:
    """One row an asset: how many partitions were made, seconds, bytes."""
    table = Table(title="Assets", title_justify="left")
    for name, justify in (
        ("asset", "left"), ("made", "right"), ("current", "right"), ("s", "right"),
        ("kB stored", "right"),
    ):  # fmt: skip
        table.add_column(name, justify=justify)  # type: ignore[arg-type]
    for system in systems:
        for plan in system.plans.values():
            found = [report for report in reports if _is_of(report, system.name, plan.name)]
            if found:
                made = sum(report["state"] == "made" for report in found)
                table.add_row(
                    plan.name,
                    str(made),
                    str(len(found) - made),
                    f"{sum(report['seconds'] for report in found):.1f}",
                    f"{sum(report.get('bytes', 0) for report in found) / 1000:.0f}",
                )
    return table


def _is_of(report: dict[str, Any], system: str, asset: str) -> bool:
    return bool(report["key"].startswith(f"{system}/{asset}/"))


def status_table(reports: Sequence[dict[str, Any]]) -> Table:
    """One row a slot of the store."""
    table = Table(title="What is stored", title_justify="left")
    for name in ("asset", "current version", "kB", "earlier", "unchecked", "rejected"):
        table.add_column(name, justify="right" if name in ("kB", "earlier") else "left")
    for report in reports:
        table.add_row(
            report["key"],
            report["version"] or "none",
            f"{report.get('bytes', 0) / 1000:.0f}",
            str(report["earlier"]),
            str(report["unchecked"] or ""),
            str(len({each["version"] for each in report["rejected"]}) or ""),
        )
    return table


def status_notes(reports: Sequence[dict[str, Any]]) -> list[str]:
    """Why versions were rejected, what is damaged, and what to do: a line each."""
    notes = []
    for report in reports:
        for each in report["rejected"]:
            notes.append(
                f"{report['key']}: version {each['version']} was rejected by {each['check']}: "
                f"{each['reason']}"
            )
        for what in report["damaged"]:
            notes.append(
                f"{report['key']}: damaged: {what}. `tsuya verify {report['key']}` mends it."
            )
    return notes
