"""A BTF compressed by a network, as a BSDF of Mitsuba 3: needs NumPy and nothing of Tsuya.

    import mitsuba as mi
    mi.set_variant("scalar_rgb")
    import tsuya_btf
    scene = mi.load_dict({..., "bsdf": {"type": "tsuya_btf", "filename": "data.npz", "tiles": 4.0}})

``tiles`` repeats the material so often over a unit of the shape's texture coordinates, of which u
goes along the material's x. ``filename`` holds decoder, latents and the table for sampling:

- ``latents`` (row, column, c) are a texture that repeats, row 0 at the top, bilinear between the
  middles of texels; a view looks them up ``parallax`` beside a place: a polynomial of the view's
  place on the stereographic plane, in columns and rows.
- The decoder says the radiance under a directional light that would give a white Lambertian surface
  the cosine of its angle: pi f cos(theta) of the BRDF f. Over alpha it is held to ``bounds``, and
  where it is less than 0, that is 0. Directions lower than 75 degrees, which no goniometer
  measured, are taken at 75 degrees, and the light is dimmed with its cosine.
- ``shares`` (view row, view column, light row, light column): how much of the light goes where, of
  the material's mean, for cells of equal area of the disc below the hemisphere: row sin²(theta),
  column phi. A cell is drawn by its share, then a point of it evenly. So the density is
  cells x share x cos(theta) / pi, exactly, and its integral is 1 for every view.

The back is black; `twosided` shows the front's values there. Light goes through Python one ray at
a time, so this is for stills of modest size; variants that compile (``llvm_*``, ``cuda_*``) are
refused.
"""

from __future__ import annotations

import math
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

LEAST_COSINE = math.cos(math.radians(75.0))
"""Of the lowest direction that goniometers measure."""


def lifted(x: float, y: float, z: float) -> tuple[float, float, float]:
    """A direction of the upper hemisphere, lifted to 75 degrees where it is lower."""
    if z >= LEAST_COSINE:
        return x, y, z
    level = math.sqrt(1.0 - LEAST_COSINE * LEAST_COSINE) / max(math.hypot(x, y), 1e-12)
    return level * x, level * y, LEAST_COSINE


def place(direction: Any) -> tuple[float, float]:
    """Of a direction, lifted, on the stereographic plane."""
    x, y, z = lifted(*direction)
    return x / (1.0 + z), y / (1.0 + z)


class Btf:
    """What `data.npz` holds, asked for one direction at a time."""

    def __init__(self, filename: str) -> None:
        with np.load(filename) as arrays:
            self.layers = [
                (arrays[f"weight_{number}"], arrays[f"bias_{number}"]) for number in range(1, 5)
            ]
            self.latents, self.parallax = arrays["latents"], arrays["parallax"]
            self.alpha = float(arrays["alpha"])
            self.least, self.largest = arrays["bounds"].tolist()
            shares = arrays["shares"].astype(np.float64)
        self.height, self.width = self.latents.shape[:2]
        self.view_cells, self.light_cells = shares.shape[:2], shares.shape[2:]
        flat = shares.reshape(*self.view_cells, -1)
        self.shares = flat / flat.sum(axis=-1, keepdims=True)
        self.summed = self.shares.cumsum(axis=-1)

    def radiance(self, u: float, v: float, light: Any, view: Any) -> Any:
        """At (u, v), v upwards: (3,), for directions (x, y, z) above the surface."""
        towards = place(light), place(view)
        values = np.concatenate([self.latents_at(u, v, *towards[1]), *towards]).astype(np.float32)
        for weight, bias in self.layers[:-1]:
            values = np.maximum(weight @ values + bias, 0.0)
        weight, bias = self.layers[-1]
        dimmed = self.alpha * min(light[2] / LEAST_COSINE, 1.0)
        colour = np.clip(weight @ values + bias, self.least, self.largest)
        return dimmed * np.maximum(colour, 0.0)

    def latents_at(self, u: float, v: float, x: float, y: float) -> Any:
        """(c,) at (u, v), from a view at (x, y) of the stereographic plane."""
        terms = [x, y, x * x, x * y, y * y, x**3, x * x * y, x * y * y, y**3]
        across, down = np.array(terms) @ self.parallax
        column = u * self.width - 0.5 + float(across)
        row = (1.0 - v) * self.height - 0.5 + float(down)
        left, top = math.floor(column), math.floor(row)
        right, below = column - left, row - top
        left, top = left % self.width, top % self.height
        beside, under = (left + 1) % self.width, (top + 1) % self.height
        upper = self.latents[top, left] * (1 - right) + self.latents[top, beside] * right
        lower = self.latents[under, left] * (1 - right) + self.latents[under, beside] * right
        return upper * (1 - below) + lower * below

    def density(self, light: Any, view: Any) -> float:
        """Per steradian, with which `drawn` returns a light."""
        row, column = cell(light, self.light_cells)
        share = self.shares[cell(view, self.view_cells)][row * self.light_cells[1] + column]
        return float(share * len(self.summed[0, 0]) * light[2] / math.pi)

    def drawn(self, view: Any, pick: float, point: tuple[float, float]) -> Any:
        """A light for a view, of a number and two more in [0, 1)."""
        summed = self.summed[cell(view, self.view_cells)]
        number = min(int(np.searchsorted(summed, pick, side="right")), len(summed) - 1)
        rows, columns = self.light_cells
        sine2 = (number // columns + point[0]) / rows
        phi = 2.0 * math.pi * (number % columns + point[1]) / columns
        sine = math.sqrt(sine2)
        return sine * math.cos(phi), sine * math.sin(phi), math.sqrt(max(1.0 - sine2, 0.0))


def cell(direction: Any, cells: tuple[int, ...]) -> tuple[int, int]:
    """Row and column of a direction, of cells (rows, columns)."""
    x, y, z = direction
    row = min(int((1.0 - z * z) * cells[0]), cells[0] - 1)
    turns = math.atan2(y, x) / (2.0 * math.pi)
    return row, min(int((turns - math.floor(turns)) * cells[1]), cells[1] - 1)


class TsuyaBtf(mi.BSDF):
    """The plug-in ``tsuya_btf``."""

    def __init__(self, props: Any) -> None:
        mi.BSDF.__init__(self, props)
        if dr.is_jit_v(mi.Float):
            raise RuntimeError(
                f"tsuya_btf is of scalar variants; found {mi.variant()}: expected scalar_rgb."
            )
        resolver = mi.file_resolver()
        self.btf = Btf(str(resolver.resolve(props["filename"])))
        self.tiles = float(props.get("tiles", 1.0))
        flags = mi.BSDFFlags.GlossyReflection | mi.BSDFFlags.Anisotropic
        flags = flags | mi.BSDFFlags.SpatiallyVarying | mi.BSDFFlags.FrontSide
        self.m_components = [flags]
        self.m_flags = flags

    def sample(
        self, ctx: Any, si: Any, sample1: float, sample2: Any, active: bool = True
    ) -> tuple[Any, Any]:
        """A light, and what comes from there is multiplied with."""
        found = mi.BSDFSample3f()
        if not self._asked(ctx) or si.wi.z <= 0.0:
            return found, mi.Color3f(0.0)
        view = (si.wi.x, si.wi.y, si.wi.z)
        light = self.btf.drawn(view, sample1, (sample2.x, sample2.y))
        found.wo = mi.Vector3f(*light)
        found.pdf = self.btf.density(light, view)
        found.eta = 1.0
        found.sampled_type = self.m_flags
        found.sampled_component = 0
        if found.pdf <= 0.0:
            return found, mi.Color3f(0.0)
        return found, self._value(si, light, view) / found.pdf

    def eval(self, ctx: Any, si: Any, wo: Any, active: bool = True) -> Any:
        """f cos(theta)."""
        if not self._asked(ctx) or si.wi.z <= 0.0 or wo.z <= 0.0:
            return mi.Color3f(0.0)
        return self._value(si, (wo.x, wo.y, wo.z), (si.wi.x, si.wi.y, si.wi.z))

    def pdf(self, ctx: Any, si: Any, wo: Any, active: bool = True) -> float:
        """Density per steradian with which `sample` returns a light."""
        if not self._asked(ctx) or si.wi.z <= 0.0 or wo.z <= 0.0:
            return 0.0
        return self.btf.density((wo.x, wo.y, wo.z), (si.wi.x, si.wi.y, si.wi.z))

    def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: bool = True) -> tuple[Any, float]:
        """Both."""
        return self.eval(ctx, si, wo, active), self.pdf(ctx, si, wo, active)

    def _asked(self, ctx: Any) -> bool:
        return bool(ctx.is_enabled(mi.BSDFFlags.GlossyReflection, 0))

    def _value(self, si: Any, light: Any, view: Any) -> Any:
        radiance = self.btf.radiance(self.tiles * si.uv.x, self.tiles * si.uv.y, light, view)
        return mi.Color3f(*(radiance / math.pi).tolist())

    def traverse(self, callback: Any) -> None:
        """Nothing can be differentiated."""

    def to_string(self) -> str:
        """As Mitsuba prints it."""
        size = f"{self.btf.width} x {self.btf.height} texels"
        return f"TsuyaBtf[{size}, tiles = {self.tiles:g}]"


mi.register_bsdf("tsuya_btf", TsuyaBtf)
