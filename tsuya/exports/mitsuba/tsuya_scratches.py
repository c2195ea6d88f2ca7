"""Scratched glass as a BSDF of Mitsuba 3. This file needs NumPy and nothing of Tsuya.

    import mitsuba as mi
    mi.set_variant("scalar_rgb")
    import tsuya_scratches
    scene = mi.load_dict({..., "bsdf": {"type": "tsuya_scratches", "filename": "data.npz"}})

For closed solids. Tiles of scratches lie on the solid from the world's three axes (of ``si.p``: an
object that is moved moves under its scratches). Where there is none, the glass is a smooth
dielectric. Where there is one, a share F of the light is reflected by the table of the scratch,
f = 2 / pi² rho(view, light) k F; the rest goes through: evenly for the rough share of the walls,
bent as by the smooth surface for the mirror-like share. From inside, rough walls let
(1 - F) / n² out and scatter the rest back, so the glass is reciprocal and as bright as a white
furnace around it.

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

_LEAST_REFLECTED = 0.25
"""Of a scratch's samples, from outside: its reflection is what lights are seen in."""


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
            self.head_on, self.gamma = arrays["leaning"].astype(np.float64)
            self.angles = [float(angle) for angle in arrays["angles"]]
            self.coverage = arrays["coverage"].astype(np.float32) / 255.0
            self.index, self.roughness = float(arrays["index"]), float(arrays["roughness"])
            self.tile = float(arrays["tile"])
        self.bins = len(self.table)
        self.sines = np.sin(np.linspace(-np.pi / 2, np.pi / 2, self.bins + 1))
        part = self.table * np.diff(self.sines) / np.pi
        self.shares = part.sum(axis=1)
        self.summed = part.cumsum(axis=1) / np.maximum(self.shares, 1e-30)[:, None]
        bounce = self.roughness / (1.0 - self.roughness) if self.roughness < 1.0 else math.inf
        self.blur = max(bounce / 2.0, 0.01)
        self.mean_fresnel = self._mean_fresnel()
        self.kept = 1.0 - (1.0 - self.mean_fresnel) / self.index**2

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

    def fresnel(self, lean: float, place: int) -> float:
        """F of a view whose cosine with the scratch is ``lean``, in a bin."""
        theta = abs(math.asin(min(max(lean, -1.0), 1.0)))
        share = float((2.0 * theta / math.pi) ** self.gamma[place])
        return share + (1.0 - share) * float(self.head_on[place])

    def place(self, across: float, up: float) -> int:
        """The bin of a direction's angle across the scratch."""
        angle = math.atan2(across, max(up, 0.0))
        return min(max(int((angle / math.pi + 0.5) * self.bins), 0), self.bins - 1)

    def reflected(self, lobe: Lobe, view: Any, light: Any) -> float:
        """f of the scratch without F, above the surface."""
        rows = [self.place(_dot(way, lobe.across), way[2]) for way in (view, light)]
        kernel = theta_kernel(
            theta_quantile(_dot(view, lobe.along)),
            theta_quantile(_dot(light, lobe.along)),
            self.blur,
        )
        return 2.0 / math.pi**2 * float(self.table[rows[0], rows[1]]) * kernel

    def drawn(self, lobe: Lobe, view: Any, numbers: tuple[float, float, float]) -> Any:
        """A light above the surface; its density is f cos / share, exactly."""
        row = self.summed[self.place(_dot(view, lobe.across), view[2])]
        low = min(int(np.searchsorted(row, numbers[0], side="right")), self.bins - 1)
        before = float(row[low - 1]) if low else 0.0
        inside = (numbers[0] - before) / max(float(row[low]) - before, 1e-30)
        inside = min(max(inside, 0.0), 1.0)
        sine = float(self.sines[low] + inside * (self.sines[low + 1] - self.sines[low]))
        lean = self._drawn_lean(_dot(view, lobe.along), numbers[1], numbers[2])
        rest = math.sqrt(max(1.0 - lean * lean, 0.0))
        parts = (lean, rest * sine, rest * math.sqrt(max(1.0 - sine * sine, 0.0)))
        return tuple(
            parts[0] * lobe.along[k] + parts[1] * lobe.across[k] + parts[2] * (k == 2)
            for k in range(3)
        )

    def _covered(self, position: Any, face: Any, axis: int) -> list[float]:
        facing = 1.0 if face[axis] > 0.0 else 0.0
        x = position[(axis + 1) % 3] / self.tile + 0.37 * axis + 0.11 * facing
        y = position[(axis + 2) % 3] / self.tile + 0.61 * axis + 0.23 * facing
        size = self.coverage.shape[1]
        column = min(int((x - math.floor(x)) * size), size - 1)
        row = min(int((y - math.floor(y)) * size), size - 1)
        return [float(part) for part in self.coverage[:, row, column]]

    def _drawn_lean(self, view_lean: float, u: float, v: float) -> float:
        if math.isinf(self.blur):
            return math.sqrt(u) * math.cos(2.0 * math.pi * v)
        normal = math.sqrt(-2.0 * math.log(1.0 - u)) * math.cos(2.0 * math.pi * v)
        c = (1.0 - theta_quantile(view_lean) + self.blur * normal) % 2.0
        return sine_of_quantile(2.0 - c if c > 1.0 else c)

    def _mean_fresnel(self) -> float:
        theta = (np.arange(512) + 0.5) / 512 * np.pi / 2
        weight = np.cos(theta) ** 2 / np.sum(np.cos(theta) ** 2)
        share = (2.0 * theta[:, None] / np.pi) ** self.gamma
        factor = share + (1.0 - share) * self.head_on
        return float(weight @ factor @ np.diff(self.sines) / 2)


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


def theta_quantile(sine: float) -> float:
    """Share of cos² theta below the theta of a sine."""
    s = min(max(sine, -1.0), 1.0)
    return 0.5 + (math.asin(s) + s * math.sqrt(1.0 - s * s)) / math.pi


def sine_of_quantile(c: float) -> float:
    """The sine whose quantile is c, by bisection."""
    low, high = -math.pi / 2, math.pi / 2
    for _ in range(48):
        theta = (low + high) / 2
        if theta + math.sin(theta) * math.cos(theta) > math.pi * (c - 0.5):
            high = theta
        else:
            low = theta
    return math.sin((low + high) / 2)


def theta_kernel(c_view: float, c_light: float, blur: float) -> float:
    """k: the density of the light's quantile for the view's, a Gaussian folded at 0 and 1."""
    if math.isinf(blur):
        return 1.0
    if blur > 0.4:  # by cosines: images would never end
        waves = (
            math.exp(-0.5 * (math.pi * k * blur) ** 2)
            * math.cos(math.pi * k * (1.0 - c_view))
            * math.cos(math.pi * k * c_light)
            for k in range(1, 12)
        )
        return 1.0 + 2.0 * sum(waves)
    images = (
        math.exp(-0.5 * ((sign * c_light + 2.0 * fold - 1.0 + c_view) / blur) ** 2)
        for fold in range(-2, 3)
        for sign in (-1.0, 1.0)
    )
    return sum(images) / (blur * math.sqrt(2.0 * math.pi))


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

    def _reflected_chance(self, lobe: Lobe, view: Any) -> tuple[float, float, float]:
        """From outside: F, the share that the table gives back, the chance to be sampled."""
        glass = self.glass
        place = glass.place(_dot(view, lobe.across), view[2])
        fresnel = glass.fresnel(_dot(view, lobe.along), place)
        share = float(glass.shares[place])
        returned = fresnel * share
        return fresnel, share, max(returned / (returned + 1.0 - fresnel), _LEAST_REFLECTED)

    def _value(self, lobes: list[Lobe], view: Any, light: Any) -> tuple[float, float]:
        """f cos(theta) and its density."""
        glass, value, density = self.glass, 0.0, 0.0
        even, above = abs(light[2]) / math.pi, light[2] > 0.0
        for lobe in lobes:
            if view[2] > 0.0:
                fresnel, share, chance = self._reflected_chance(lobe, view)
                if above:
                    f = glass.reflected(lobe, view, light) * light[2]
                    value += lobe.weight * fresnel * f
                    density += lobe.weight * chance * f / share if share > 0.0 else 0.0
                else:
                    rough = lobe.weight * glass.roughness * even
                    value += rough * (1.0 - fresnel) / glass.index**2
                    density += rough * (1.0 - chance)
            else:
                rough = lobe.weight * glass.roughness * even
                density += 0.5 * rough
                if above:
                    place = glass.place(_dot(light, lobe.across), light[2])
                    value += rough * (1.0 - glass.fresnel(_dot(light, lobe.along), place))
                else:
                    value += rough * glass.kept
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
        if view[2] > 0.0:
            return self._from_outside(lobe, view, pick, point)
        return self._from_inside(lobe, view, pick, point)

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

    def _from_outside(self, lobe: Lobe, view: Any, pick: float, point: tuple[float, float]) -> _Way:
        fresnel, _, chance = self._reflected_chance(lobe, view)
        if pick < chance:
            return _Way(self.glass.drawn(lobe, view, (pick / chance, *point)))
        if (pick - chance) / (1.0 - chance) < self.glass.roughness:
            return _Way(_by_cosine(point, -1.0))
        clear = lobe.weight * (1.0 - self.glass.roughness)
        return _Way(self._bent(view), clear * (1.0 - fresnel), clear * (1.0 - chance))

    def _from_inside(self, lobe: Lobe, view: Any, pick: float, point: tuple[float, float]) -> _Way:
        glass = self.glass
        if pick < glass.roughness:
            return _Way(_by_cosine(point, 1.0 if pick < 0.5 * glass.roughness else -1.0))
        clear = lobe.weight * (1.0 - glass.roughness)
        out, passes = self._bent(view), 0.0
        if out is not None:
            place = glass.place(_dot(out, lobe.across), out[2])
            passes = 1.0 - glass.fresnel(_dot(out, lobe.along), place)
        if (pick - glass.roughness) / (1.0 - glass.roughness) < passes:
            return _Way(out, clear * passes, clear * passes)
        reflected = clear * (1.0 - passes)
        return _Way((-view[0], -view[1], view[2]), reflected, reflected)

    def traverse(self, callback: Any) -> None:
        """Nothing can be differentiated."""


def _by_cosine(point: tuple[float, float], side: float) -> tuple[float, float, float]:
    radius, turn = math.sqrt(point[0]), 2.0 * math.pi * point[1]
    up = side * math.sqrt(max(1.0 - point[0], 0.0))
    return radius * math.cos(turn), radius * math.sin(turn), up


mi.register_bsdf("tsuya_scratches", TsuyaScratches)
