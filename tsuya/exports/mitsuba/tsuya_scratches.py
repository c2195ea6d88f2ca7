"""Scratched glass as a BSDF of Mitsuba 3. This file needs NumPy and nothing of Tsuya.

    import mitsuba as mi
    mi.set_variant("scalar_rgb")
    import tsuya_scratches
    scene = mi.load_dict({..., "bsdf": {"type": "tsuya_scratches", "filename": "data.npz"}})

For closed solids. Tiles of scratches lie on the solid from the world's three axes (of ``si.p``: an
object that is moved moves under its scratches). Where there is none, the glass is a smooth
dielectric. Where there is one, light goes by the table of its BSDF, of both sides: a view in bin o
gets the part rho[o, i] w[i] r[i] / pi of radiance over n² from bin i, w the difference of the sines
of the bin's ends, r the étendue of its side over that outside. Bins are of the angle across the
scratch, outside, then inside the glass. A table is made for a lean: a direction's component along
the scratch times the index where it is. Walls keep it, or forget it and spread étendue evenly.

Left out of what Tsuya's own path tracer does: coverage is that of the map's nearest texel, so close
up scratches are as sharp as the map and not as the features themselves; how light varies across a
scratch (its mean is taken). Radiance alone is carried: particle tracers are refused. So are
variants that compile (``llvm_*``, ``cuda_*``): light goes through Python one ray at a time.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np

_BLUR = 0.01
"""Deviation of the lean where walls keep it: lobes of half a degree can still be evaluated."""


class Lobe(NamedTuple):
    """A layer's scratches at a point: how likely one is there; unit vectors in the local frame."""

    weight: float
    along: tuple[float, float, float]
    across: tuple[float, float, float]


class Scratches:
    """What `data.npz` holds, asked for one direction at a time."""

    def __init__(self, filename: str) -> None:
        with np.load(filename) as arrays:
            self.table = arrays["table"].astype(np.float64)
            self.leans = [float(lean) for lean in arrays["leans"]]
            self.keeps = bool(arrays["keeps"])
            self.angles = [float(angle) for angle in arrays["angles"]]
            self.coverage = arrays["coverage"].astype(np.float32) / 255.0
            self.index, self.tile = float(arrays["index"]), float(arrays["tile"])
        self.bins = self.table.shape[-1] // 2
        self.sines = np.sin(np.linspace(-np.pi / 2, np.pi / 2, self.bins + 1))
        part = self.table * self._weights()[:, None]
        shares = part.sum(axis=-1, keepdims=True)
        self.parts = part
        self.chances = part / np.where(shares > 0.0, shares, 1.0)
        self.summed = self.chances.cumsum(axis=-1)

    def _weights(self) -> Any:
        """w r / pi of the bins of both sides (S, 2 M), for each lean."""
        rows = []
        for lean in self.leans:
            ratio = self.index**2
            if self.keeps:
                ratio = math.sqrt((ratio - lean**2) / (1.0 - lean**2)) if lean < 1.0 else 1.0
            weight = np.diff(self.sines) / np.pi
            rows.append(np.concatenate([weight, ratio * weight]))
        return np.array(rows)

    def lobes(self, position: Any, face: Any, frame: Any) -> tuple[float, list[Lobe]]:
        """How likely there is no scratch at a point, and those that there may be."""
        clear, found = 0.0, []
        fourth = [component**4 for component in face]
        for axis in range(3):
            share = fourth[axis] / sum(fourth)
            if share < 1e-6:
                continue
            covered = self._covered(position, face, axis)
            clear += share * math.prod(1.0 - part for part in covered)
            for layer, part in enumerate(covered):
                if part <= 0.0:
                    continue
                others = covered[:layer] + covered[layer + 1 :]
                directions = _directions(self.angles[layer], axis, frame)
                if directions is None:
                    clear += share * part * _first_of(others)
                else:
                    found.append(Lobe(share * part * _first_of(others), *directions))
        return clear, found

    def scattered(self, lobe: Lobe, view: Any, light: Any) -> tuple[float, float]:
        """Part of the light from there that the view gets, and the density of `drawn`, both per
        steradian."""
        row, column = self._bin(lobe, view), self._bin(lobe, light)
        value = density = 0.0
        for table, share in self._tables(self._lean(lobe, view)):
            value += share * float(self.parts[table, row, column])
            density += share * float(self.chances[table, row, column])
        if density <= 0.0:
            return 0.0, 0.0
        spread = self._spread(lobe, view, light, column % self.bins)
        return value * spread, density * spread

    def drawn(self, lobe: Lobe, view: Any, numbers: tuple[float, float, float]) -> Any:
        """A light; None where the view gets none."""
        pick, u, v = numbers
        (table, first), *others = self._tables(self._lean(lobe, view))
        if others and pick >= first:
            pick, first, table = pick - first, 1.0 - first, others[0][0]
        pick /= first
        row = self.summed[table, self._bin(lobe, view)]
        if row[-1] <= 0.0:
            return None
        found = min(int(np.searchsorted(row, pick, side="right")), len(row) - 1)
        before = float(row[found - 1]) if found else 0.0
        inside = (pick - before) / max(float(row[found]) - before, 1e-30)
        ends = self.sines[found % self.bins : found % self.bins + 2]
        sine = float(ends[0] + min(max(inside, 0.0), 1.0) * (ends[1] - ends[0]))
        side = 1.0 if found < self.bins else self.index
        along = self._drawn_lean(-self._lean(lobe, view), side, u, v) / side
        rest = math.sqrt(max(1.0 - along * along, 0.0))
        up = rest * math.sqrt(max(1.0 - sine * sine, 0.0))
        x, y, _ = (along * lobe.along[k] + rest * sine * lobe.across[k] for k in range(3))
        return x, y, up if found < self.bins else -up

    def _lean(self, lobe: Lobe, way: Any) -> float:
        return _dot(way, lobe.along) * (1.0 if way[2] > 0.0 else self.index)

    def _bin(self, lobe: Lobe, way: Any) -> int:
        angle = math.atan2(_dot(way, lobe.across), abs(way[2]))
        found = min(max(int((angle / math.pi + 0.5) * self.bins), 0), self.bins - 1)
        return found if way[2] > 0.0 else self.bins + found

    def _tables(self, lean: float) -> list[tuple[int, float]]:
        """Numbers of the tables next to a lean, and the share of each."""
        lean, last = abs(lean), len(self.leans) - 1
        if self.keeps and lean < 1.0:
            last -= 1  # there is nothing between the last lean below 1 and 1
        if lean >= self.leans[last]:
            return [(last, 1.0)]
        high = next(n for n, above in enumerate(self.leans) if above > lean)
        share = (lean - self.leans[high - 1]) / (self.leans[high] - self.leans[high - 1])
        return [(high - 1, 1.0 - share), (high, share)]

    def _spread(self, lobe: Lobe, view: Any, light: Any, place: int) -> float:
        """What turns a part of a bin into a density per steradian."""
        side = 1.0 if light[2] > 0.0 else self.index
        lean = self._lean(lobe, light)
        if self.keeps:
            mirrored = -self._lean(lobe, view)
            images = (lean, 2.0 * side - lean, -2.0 * side - lean)
            total = sum(math.exp(-0.5 * ((image - mirrored) / _BLUR) ** 2) for image in images)
            density = total / (_BLUR * math.sqrt(2.0 * math.pi))
        else:
            density = 2.0 * math.sqrt(max(side**2 - lean**2, 0.0)) / (math.pi * side**2)
        rest = math.sqrt(max(1.0 - (lean / side) ** 2, 1e-12))
        width = float(self.sines[place + 1] - self.sines[place])
        return density * side * abs(float(light[2])) / (rest * width)

    def _drawn_lean(self, mirrored: float, side: float, u: float, v: float) -> float:
        if not self.keeps:
            return side * math.sqrt(u) * math.cos(2.0 * math.pi * v)  # the semicircle's law
        normal = math.sqrt(-2.0 * math.log(1.0 - u)) * math.cos(2.0 * math.pi * v)
        lean = mirrored + _BLUR * normal
        if lean > side:
            lean = 2.0 * side - lean
        if lean < -side:
            lean = -2.0 * side - lean
        return min(max(lean, -side), side)

    def _covered(self, position: Any, face: Any, axis: int) -> list[float]:
        facing = 1.0 if face[axis] > 0.0 else 0.0
        x = position[(axis + 1) % 3] / self.tile + 0.37 * axis + 0.11 * facing
        y = position[(axis + 2) % 3] / self.tile + 0.61 * axis + 0.23 * facing
        size = self.coverage.shape[1]
        column = min(int((x - math.floor(x)) * size), size - 1)
        row = min(int((y - math.floor(y)) * size), size - 1)
        return [float(part) for part in self.coverage[:, row, column]]


def _first_of(others: list[float]) -> float:
    """The chance to be chosen, all alike, among those of ``others`` that are there too."""
    counts = [1.0]
    for part in others:
        longer = [*counts, 0.0]
        counts = [
            (1.0 - part) * longer[k] + (part * longer[k - 1] if k else 0.0)
            for k in range(len(longer))
        ]
    return sum(chance / (number + 1) for number, chance in enumerate(counts))


def _directions(angle: float, axis: int, frame: Any) -> Any:
    """Along and across a scratch in the local frame; None where it has no direction there."""
    along = [0.0, 0.0, 0.0]
    along[(axis + 1) % 3], along[(axis + 2) % 3] = math.cos(angle), math.sin(angle)
    local = frame.to_local(mi.Vector3f(*along))
    length = math.hypot(local.x, local.y)
    if length < 1e-6:
        return None
    x, y = local.x / length, local.y / length
    return (x, y, 0.0), (-y, x, 0.0)


def _dot(one: Any, other: Any) -> float:
    return float(one[0] * other[0] + one[1] * other[1] + one[2] * other[2])


class _Way(NamedTuple):
    """A direction that was drawn; ``gain`` and ``chance`` where it is the only one possible."""

    direction: Any
    gain: float = 0.0
    chance: float = 0.0


class TsuyaScratches(mi.BSDF):
    """The plug-in ``tsuya_scratches``."""

    def __init__(self, props: Any) -> None:
        mi.BSDF.__init__(self, props)
        if dr.is_jit_v(mi.Float):
            raise RuntimeError(
                f"tsuya_scratches is of scalar variants; found {mi.variant()}: expected scalar_rgb."
            )
        self.glass = Scratches(str(mi.file_resolver().resolve(props["filename"])))
        sides = mi.BSDFFlags.FrontSide | mi.BSDFFlags.BackSide | mi.BSDFFlags.SpatiallyVarying
        self.m_components = [
            mi.BSDFFlags.GlossyReflection | mi.BSDFFlags.Anisotropic | sides,
            mi.BSDFFlags.GlossyTransmission | mi.BSDFFlags.NonSymmetric | sides,
            mi.BSDFFlags.DeltaReflection | sides,
            mi.BSDFFlags.DeltaTransmission | mi.BSDFFlags.NonSymmetric | sides,
        ]
        self.m_flags = 0
        for flags in self.m_components:
            self.m_flags = flags | self.m_flags
        self._last: tuple[Any, Any] = (None, None)

    def sample(
        self, ctx: Any, si: Any, sample1: float, sample2: Any, active: bool = True
    ) -> tuple[Any, Any]:
        """A light, and what comes from there is multiplied with."""
        self._check(ctx)
        found = mi.BSDFSample3f()
        view = (si.wi.x, si.wi.y, si.wi.z)
        if view[2] == 0.0:
            return found, mi.Color3f(0.0)
        clear, lobes = self._lobes(si)
        way = self._drawn(clear, lobes, view, sample1, (sample2.x, sample2.y))
        if way.direction is None or way.direction[2] == 0.0:
            return found, mi.Color3f(0.0)
        through = way.direction[2] * view[2] < 0.0
        found.wo = mi.Vector3f(*way.direction)
        found.eta = (
            (self.glass.index if view[2] > 0.0 else 1.0 / self.glass.index) if through else 1.0
        )
        is_delta = way.chance > 0.0
        found.sampled_component = 2 * is_delta + through
        found.sampled_type = self.m_components[found.sampled_component]
        if is_delta:
            found.pdf = way.chance
            return found, mi.Color3f(way.gain / way.chance * (found.eta**-2 if through else 1.0))
        value, found.pdf = self._value(lobes, view, way.direction)
        if found.pdf <= 0.0:
            return found, mi.Color3f(0.0)
        return found, mi.Color3f(value / found.pdf)

    def eval(self, ctx: Any, si: Any, wo: Any, active: bool = True) -> Any:
        """f cos(theta) of what is scattered."""
        return self.eval_pdf(ctx, si, wo, active)[0]

    def pdf(self, ctx: Any, si: Any, wo: Any, active: bool = True) -> float:
        """Density per steradian with which `sample` returns a light that is scattered."""
        return float(self.eval_pdf(ctx, si, wo, active)[1])

    def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: bool = True) -> tuple[Any, float]:
        """Both."""
        self._check(ctx)
        if si.wi.z == 0.0 or wo.z == 0.0:
            return mi.Color3f(0.0), 0.0
        _, lobes = self._lobes(si)
        value, density = self._value(lobes, (si.wi.x, si.wi.y, si.wi.z), (wo.x, wo.y, wo.z))
        return mi.Color3f(value), density

    def _check(self, ctx: Any) -> None:
        if ctx.mode != mi.TransportMode.Radiance:
            raise RuntimeError("tsuya_scratches carries radiance; expected no particle tracer.")
        if ctx.component != 0xFFFFFFFF or ctx.type_mask != 0x1FF:
            raise RuntimeError("tsuya_scratches is one thing; expected no choice of components.")

    def _lobes(self, si: Any) -> tuple[float, list[Lobe]]:
        key = (si.p.x, si.p.y, si.p.z, si.n.x, si.n.y, si.n.z, *si.sh_frame.n)
        last_key, last = self._last
        if key != last_key:
            last = self.glass.lobes(key[:3], key[3:6], si.sh_frame)
            self._last = (key, last)
        return last

    def _value(self, lobes: list[Lobe], view: Any, light: Any) -> tuple[float, float]:
        """f cos(theta) and its density."""
        value = density = 0.0
        for lobe in lobes:
            part, chance = self.glass.scattered(lobe, view, light)
            value += lobe.weight * part
            density += lobe.weight * chance
        if view[2] * light[2] < 0.0:  # the table has radiance over n²
            value *= self.glass.index ** (2.0 if view[2] < 0.0 else -2.0)
        return value, density

    def _drawn(
        self, clear: float, lobes: list[Lobe], view: Any, pick: float, point: tuple[float, float]
    ) -> _Way:
        if pick < clear:
            return self._smooth(clear, view, pick / clear)
        pick -= clear
        for lobe in lobes:
            if pick < lobe.weight:
                break
            pick -= lobe.weight
        else:
            return _Way(None)
        pick = min(max(pick / lobe.weight, 0.0), 1.0 - 1e-7)
        return _Way(self.glass.drawn(lobe, view, (pick, *point)))

    def _smooth(self, clear: float, view: Any, pick: float) -> _Way:
        reflectance = mi.fresnel(view[2], self.glass.index)[0]
        if pick < reflectance:
            return _Way((-view[0], -view[1], view[2]), clear * reflectance, clear * reflectance)
        through = clear * (1.0 - reflectance)
        return _Way(self._bent(view), through, through)

    def _bent(self, view: Any) -> Any:
        """Through the smooth surface; None where light is totally reflected."""
        ratio = 1.0 / self.glass.index if view[2] > 0.0 else self.glass.index
        x, y = -ratio * view[0], -ratio * view[1]
        z2 = 1.0 - x * x - y * y
        return (x, y, -math.copysign(math.sqrt(z2), view[2])) if z2 > 0.0 else None

    def traverse(self, callback: Any) -> None:
        """Nothing can be differentiated."""


mi.register_bsdf("tsuya_scratches", TsuyaScratches)
