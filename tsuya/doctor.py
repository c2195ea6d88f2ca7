"""What the project needs of a machine, checked one by one; the last check draws a picture."""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from assets_defs.workspace import CHECKOUT, Workspace

LEAST_FREE_BYTES = 2 * 10**9


@dataclass(frozen=True)
class Finding:
    """One requirement: whether it is met, and what was found or what to do."""

    requirement: str
    met: bool
    found: str


def examine(picture: Path) -> list[Finding]:
    """Check every requirement; the picture that is drawn goes to the given PNG file."""
    checks: tuple[tuple[str, Callable[[], str]], ...] = (
        ("Python", _python),
        ("set up by `make setup`", _set_up),
        ("folder for data", _data),
        ("ray casting (Open3D with Embree)", _rays),
        ("training (PyTorch)", _training),
        ("drawing without a screen", lambda: _drawing(picture)),
    )
    findings = []
    for requirement, check in checks:
        try:
            findings.append(Finding(requirement, True, check()))
        except Exception as error:  # whatever is wrong is what the doctor is to tell
            findings.append(Finding(requirement, False, str(error).strip() or repr(error)))
    return findings


def _python() -> str:
    return ".".join(map(str, sys.version_info[:3]))


def _set_up() -> str:
    home = os.environ.get("DAGSTER_HOME")
    if not home or not (Path(home) / "dagster.yaml").is_file():
        raise RuntimeError(
            f"DAGSTER_HOME is {home!r}; expected a folder with dagster.yaml: run `make setup`."
        )
    return f"DAGSTER_HOME {_short(Path(home))}"


def _data() -> str:
    root = Workspace.from_environment().root
    root.mkdir(parents=True, exist_ok=True)
    if not os.access(root, os.W_OK):
        raise RuntimeError(f"{root} cannot be written; expected a folder of yours.")
    free = shutil.disk_usage(root).free
    if free < LEAST_FREE_BYTES:
        raise RuntimeError(f"{root} has {free / 1e9:.1f} GB free; expected 2 GB.")
    return f"{_short(root)}, {free / 1e9:.0f} GB free"


def _rays() -> str:
    try:
        import open3d
    except (ImportError, OSError) as error:
        raise RuntimeError(
            f"Open3D cannot be loaded ({error}); on Debian and Ubuntu: "
            "sudo apt-get install libusb-1.0-0 libgomp1"
        ) from error
    return f"Open3D {open3d.__version__}"


def _training() -> str:
    import torch

    card = torch.cuda.get_device_name() if torch.cuda.is_available() else "no graphics card"
    return f"PyTorch {torch.__version__}, {card}"


def _drawing(picture: Path) -> str:
    from PIL import Image

    from pipelines.drawing.stage import Light, Stage, orbit, surface
    from pipelines.geometry.shapes import teapot

    mesh = teapot(8)
    centre = tuple((mesh.vertices.min(axis=0) + mesh.vertices.max(axis=0)) / 2)
    with Stage(320, 240, background=(0.05, 0.06, 0.08), supersampling=2) as stage:
        stage.add(
            surface(mesh.vertices, mesh.triangles, normals=mesh.normals, colour=(0.6, 0.2, 0.1))
        )
        stage.light(Light(towards=(1.0, -1.0, 2.0)), Light(colour=(0.2, 0.2, 0.2)))
        stage.look(orbit(centre, 4.5, -60.0, 25.0))
        frame = stage.frame()
        name = stage.renderer_name
    if frame.std() < 1.0:
        raise RuntimeError(f"{name} drew an empty picture; expected a teapot.")
    picture.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(frame).save(picture)
    return f"{name}; see {_short(picture)}"


def _short(path: Path) -> str:
    return str(path.relative_to(CHECKOUT)) if path.is_relative_to(CHECKOUT) else str(path)
