"""Make docs/inputs.md from what became of the cases when they were last measured: ``make docs``."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from storage.readers.drives.formats import FORMATS, UNPOSED

PAGE = Path(__file__).parent / "inputs.md"
RESULTS = Path("benchmarks") / "results" / "captures.json"

TITLES = {
    "light_probes": "Light probes",
    "photographs": "Photographs",
    "meshes": "Meshes: OBJ, PLY",
    "gltf": "Meshes and scenes: glTF 2.0",
    "materials": "Materials of scenes",
    "profiles": "Cross-sections of scratches",
    "databases": "Material databases",
}
_INTRODUCTION = """# What goes in

Made by `make docs` from `benchmarks/results/captures.json` (`python -m benchmarks captures`).

One rule holds for every reader. What has a known meaning is *converted*. What every other tool
mends is *mended*. Both are said in a note, and so is what a file holds and is not used: notes
stay with the version, the web UI shows them with the asset, the command line prints them. What
has no safe reading is *refused* before any work, in one sentence that names the file, the field,
what was found, what is expected and so the way out. Nothing is dropped in silence.

![Five files before and after](pictures/inputs.png)

Above as they were read before, below as they are read now: colours of vertices; three instances by
`EXT_mesh_gpu_instancing`; a skin in its rest pose; specular-glossiness (a black metal before,
rejected by a check); a closed mesh that is inside out, in fur.

Below is each case that is tested: files as they were met and files written as other programs
write them, with what became of each and the words in which it is said. `read` is without a note."""


def input_page(results: dict[str, Any]) -> str:
    """The page."""
    lines = [
        _INTRODUCTION,
        "",
        f"{results['cases']} cases of {results['kinds']} kinds: "
        + ", ".join(f"{count} {ending}" for ending, count in sorted(results["endings"].items()))
        + ".",
    ]
    for group, title in TITLES.items():
        lines += [
            "",
            f"## {title}",
            "",
            "| file | kind | ends | what is said |",
            "|---|---|---|---|",
        ]
        for row in results["files"]:
            if row["group"] == group:
                cells = (f"`{row['file']}`", row["kind"], row["ending"], row["what"])
                lines.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    return "\n".join([*lines, *_drives()]) + "\n"


def _drives() -> list[str]:
    """The formats of drives, the most specific first."""
    return [
        "",
        "## Drives",
        "",
        "A film, or a folder: its format is found from the files in it, the first that there is.",
        "",
        "| format | known by | what is read |",
        "|---|---|---|",
        *(
            f"| {known.name} | `{known.known_by}` | {known.sentence} |"
            for known in (*FORMATS, *UNPOSED)
        ),
    ]


if __name__ == "__main__":
    PAGE.write_text(input_page(json.loads(RESULTS.read_text())))
