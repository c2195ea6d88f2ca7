"""Make docs/assets.md from the schemas and the checks: ``make docs``."""

from __future__ import annotations

from pathlib import Path

from assets_defs.systems import SYSTEMS

PAGE = Path(__file__).parent / "assets.md"


def asset_page() -> str:
    """The page: every asset with its variables and its checks."""
    lines = [
        "# Assets",
        "",
        "Made by `make docs` from `storage/schemas/` and the checks in `assets_defs/`.",
    ]
    for system in SYSTEMS.values():
        lines += ["", f"## {system.title} (`{system.name}`)"]
        for plan in system.plans.values():
            inputs = ", ".join(f"`{name}`" for name in plan.inputs) or "a file or a built-in item"
            lines += [
                "",
                f"### `{system.name}/{plan.name}`",
                "",
                plan.schema.meaning,
                "",
                f"One for each {' and '.join(plan.by)}; made from {inputs}; "
                f"schema {plan.schema.number}.",
                "",
                plan.schema.markdown(),
                "",
                "| check | bounds | figure |",
                "|---|---|---|",
            ]
            lines += [
                f"| `{check.name}` | {check.bounds()} | {check.description} |"
                for check in plan.checks
            ]
            lines += ["", "| setting | demo | what |", "|---|---|---|"]
            lines += [
                f"| `{name}` | {field.default} | {field.description or ''} |"
                for name, field in plan.settings.model_fields.items()
            ]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    PAGE.write_text(asset_page())
