"""Renders scene.xml: `python render.py` (Mitsuba 3: `pip install mitsuba numpy`)."""

from __future__ import annotations

import argparse
import importlib
import sys
from pathlib import Path

import mitsuba as mi

FOLDER = Path(__file__).resolve().parent


def main() -> None:
    """Write the picture as linear EXR and as 8-bit PNG."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--width", type=int, default=320, help="pixels; the height is 3/4 of it")
    parser.add_argument("--samples", type=int, default=16, help="paths a pixel")
    parser.add_argument("--out", type=Path, default=FOLDER / "picture", help="without an ending")
    asked = parser.parse_args()
    mi.set_variant("scalar_rgb")
    sys.path.insert(0, str(FOLDER))
    for plug_in in FOLDER.glob("tsuya_*.py"):
        importlib.import_module(plug_in.stem)
    size = {"width": str(asked.width), "height": str(asked.width * 3 // 4)}
    scene = mi.load_file(str(FOLDER / "scene.xml"), samples=str(asked.samples), **size)
    picture = mi.Bitmap(mi.render(scene))
    picture.write(f"{asked.out}.exr")
    eight_bit = picture.convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.UInt8, srgb_gamma=True)
    eight_bit.write(f"{asked.out}.png")


if __name__ == "__main__":
    main()
