"""Make docs/packages.md from the declarations of all systems' packages: ``make docs``."""

from __future__ import annotations

from pathlib import Path

from storage.packages import ArrayPart, MeshPart, PackageSchema, package_schemas
from storage.packages.schema import Part

PAGE = Path(__file__).parent / "packages.md"

_INTRODUCTION = """# Packages, system by system

Made by `make docs` from `storage/packages/`. [How a package is read](package_format.md) comes
first: the zip, `meta.json`, the kinds of parts, views."""


def package_page(schemas: tuple[PackageSchema, ...]) -> str:
    """The page."""
    lines = [_INTRODUCTION]
    for schema in schemas:
        lines += ["", f"## `{schema.system}`, schema {schema.number}", "", schema.meaning, ""]
        lines += ["| part | kind | dimensions | type | units | what |", "|---|---|---|---|---|---|"]
        lines += [_row(name, part) for name, part in schema.parts.items()]
        if schema.parameters:
            lines += ["", "| parameter | units | what |", "|---|---|---|"]
            lines += [
                f"| `{name}` | {each.units} | {_with_source(each.meaning, each.source)} |"
                for name, each in schema.parameters.items()
            ]
        if schema.decoding:
            lines += ["", schema.decoding.strip()]
    return "\n".join(lines) + "\n"


def _row(name: str, part: Part) -> str:
    if isinstance(part, MeshPart):
        attributes = ", ".join(f"`_{key}`: {what}" for key, what in part.attributes.items())
        standard = [text for text, there in (("normals", part.normals), ("uvs", part.uvs)) if there]
        dims, dtype = ", ".join(standard), "float32"
        meaning = f"{part.meaning}{'; ' if attributes else ''}{attributes}"
    else:
        dims = ", ".join(part.dims) or "scalar"
        if not isinstance(part, ArrayPart):
            dims = dims.replace("channel", f"{part.channels} channels")
        dtype, meaning = part.dtype, part.meaning
    only = " *(where there is one)*" if part.optional else ""
    return (
        f"| `{name}` | {part.kind} | {dims} | {dtype} | {part.units} "
        f"| {_with_source(meaning, part.source)}{only} |"
    )


def _with_source(meaning: str, source: str) -> str:
    return f"{meaning} ({source})" if source else meaning


if __name__ == "__main__":
    PAGE.write_text(package_page(package_schemas()))
