"""The scratched glass for programs that know nothing of the store: `glass_package`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

from pydantic import Field

from assets_defs.glass_scratches.declaration import ENVIRONMENTS, OBJECTS, SCRATCHES, SETTINGS
from assets_defs.glass_scratches.frames import FrameSettings, environment
from assets_defs.packages import PackageSettings, package_dataset, read_back_check
from assets_defs.settings import Preset
from assets_defs.system import Result
from storage.schemas import glass_scratches as schemas
from storage.stored_version import StoredVersion

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr
    from numpy.typing import NDArray

    from pipelines.geometry.solids import Solid
    from pipelines.glass_scratches.drawing.live_parts import ReferenceView
    from pipelines.glass_scratches.drawing.stage_view import ScratchedActor
    from pipelines.glass_scratches.scratched_glass import ScratchMaterial
    from storage.packages import Contents, Figure, View

_OTHERS = ("room", "lamps", "sky")
"""Environments that each package has beside its own."""
_OWN = "own"
"""What a user's environment is called in the package."""
_BUILT_IN = "Apache-2.0 (made by Tsuya)"


class GlassPackageSettings(PackageSettings):
    """What the package holds beside the glass."""

    environment_rows: int = Field(
        512, ge=8, le=2048, description="Most rows of its environments, texels"
    )
    view_size: int = Field(
        320, ge=32, le=1024, description="Height and width of its reference pictures, pixels"
    )

    sizes: ClassVar[Mapping[Preset, Mapping[str, object]]] = {
        "test": {"environment_rows": 64, "view_size": 96},
    }


def _expected(version: StoredVersion) -> dict[str, Any]:
    """Parts as the datasets have them, by NumPy alone."""
    import numpy as np

    table, layers = version.input("scratch_table"), version.input("scratch_layers")
    return {
        "table": _means(table["rho"].values.astype(np.float64), 64).astype(np.float16),
        "leans": table["lean"].values.astype(np.float32),
        "angles": layers["angle"].values,
        "coverage": np.round(255.0 * layers["coverage"].values).astype(np.uint8)[..., None],
        "object": _expected_mesh(version.input("glass_object")),
    }


def _means(rho: NDArray[np.float64], most: int) -> NDArray[np.float64]:
    """Tables with at most as many bins a side, by loops over the bins of the fine ones."""
    import numpy as np

    bins = rho.shape[1] // 2
    if bins <= most:
        return rho
    edges = np.sin(np.linspace(-np.pi / 2, np.pi / 2, bins + 1))
    weight = np.tile(np.diff(edges), 2)
    size = bins // most
    whole = np.add.reduceat(weight, np.arange(0, 2 * bins, size))
    rows = np.add.reduceat(rho * weight[:, None], np.arange(0, 2 * bins, size), axis=1)
    both = np.add.reduceat(rows * weight, np.arange(0, 2 * bins, size), axis=2)
    means: NDArray[np.float64] = both / (whole[:, None] * whole)
    return means


def _expected_mesh(glass_object: xr.Dataset) -> Any:
    import numpy as np

    from storage.packages import Mesh

    corners = glass_object["vertices"].values[glass_object["triangles"].values]
    first, second, third = np.moveaxis(corners, 1, 0)
    facing = np.cross(second - first, third - first)
    facing /= np.linalg.norm(facing, axis=1, keepdims=True)
    return Mesh(
        corners.reshape(-1, 3).astype(np.float32),
        np.arange(3 * len(corners), dtype=np.uint32).reshape(-1, 3),
        glass_object["corner_normals"].values.reshape(-1, 3),
        attributes={"FACING": facing.repeat(3, axis=0).astype(np.float32)},
    )


@SCRATCHES.asset(
    schemas.GLASS_PACKAGE,
    by=("setting", "object"),
    settings=GlassPackageSettings,
    inputs=(
        "scratch_profile",
        "scratch_table_2d",
        "scratch_table",
        "scratch_layers",
        "glass_object",
        "glass_frames",
    ),
    kinds=frozenset({"zarr", "pyvista"}),
    checks=(read_back_check(_expected),),
)
def glass_package(
    *,
    settings: GlassPackageSettings,
    lineage: Sequence[Mapping[str, Any]],
    scratch_profile: xr.Dataset,
    scratch_table_2d: xr.Dataset,
    scratch_table: xr.Dataset,
    scratch_layers: xr.Dataset,
    glass_object: xr.Dataset,
    glass_frames: xr.Dataset,
) -> Result:
    """Pack the table, the layers, the object and its light, and draw the reference views."""
    from assets_defs.glass_scratches.datasets import material_of, solid_of
    from storage.packages import write_package
    from storage.packages.glass_scratches import PACKAGE

    light = light_of(settings, lineage, glass_frames)
    material = material_of(scratch_table_2d, scratch_table, scratch_layers)
    walls = next(step["settings"] for step in lineage if step["asset"] == "scratch_table_2d")
    glass = _Glass(solid_of(glass_object), material, light, float(walls["roughness"]))
    views = glass.views(settings.view_size)
    values = glass.parts() | {f"reference_{view.name}": view.frame for view in views}
    values |= {"poster": glass.poster(), "input": _input(scratch_profile)}
    names = (scratch_profile.attrs["name"], glass_object.attrs["name"], light.source)
    figures = _figures(scratch_table_2d, scratch_table, scratch_layers, glass_frames)
    contents = glass.contents(names, values, views, figures, lineage, settings.licence)
    content = write_package(PACKAGE, contents)
    return package_dataset(content), {"bytes": len(content)}


# ---- light -----------------------------------------------------------------------------------


class _Light(NamedTuple):
    """Environments of a package, in halfs, by name; first that of the reference pictures."""

    environments: Mapping[str, NDArray[np.float16]]
    source: str
    """The first one's name, or its file's."""
    tile: float
    exposure: float


def light_of(
    settings: GlassPackageSettings,
    lineage: Sequence[Mapping[str, Any]],
    glass_frames: xr.Dataset,
) -> _Light:
    """The frames' environment, made or read again, and the built-in ones.

    Raises ValueError where a user's file is not what it was, BadInput where it is gone.
    """
    import numpy as np

    from pipelines.glass_scratches.drawing.live_parts import half_radiance
    from pipelines.light.environment_maps import mean_radiance

    chosen = next(step["settings"] for step in lineage if step["asset"] == "glass_frames")
    shown = FrameSettings(**chosen)
    radiance = environment(shown).radiance
    if not np.allclose(mean_radiance(radiance), glass_frames["surroundings"].values):
        raise ValueError(
            f"{shown.environment} has changed since glass_frames was made; "
            "expected the same file: run glass_frames again."
        )
    built_in = shown.environment in ENVIRONMENTS
    name = shown.environment if built_in else _OWN
    others = {
        other: environment(FrameSettings(environment=other, light_rows=shown.light_rows)).radiance
        for other in _OTHERS
        if other != name
    }
    halfs = {
        key: half_radiance(each, settings.environment_rows)
        for key, each in {name: radiance, **others}.items()
    }
    source = name if built_in else Path(shown.environment).name
    return _Light(halfs, source, shown.tile, float(glass_frames["exposure"]))


# ---- what is packed --------------------------------------------------------------------------


class _Glass:
    """A scratched solid and its light, as parts and views."""

    def __init__(
        self, solid: Solid, material: ScratchMaterial, light: _Light, roughness: float
    ) -> None:
        import numpy as np

        from pipelines.light.environment_sampling import make_environment_sampler

        self.solid, self.material, self.light = solid, material, light
        self.roughness = roughness
        self.name = next(iter(light.environments))
        self.samplers = {
            name: make_environment_sampler(halfs.astype(np.float32))
            for name, halfs in light.environments.items()
        }

    def parts(self) -> dict[str, Any]:
        """Values by the names of parts."""
        import numpy as np

        from pipelines.glass_scratches.drawing import live_parts, stage_view
        from pipelines.glass_scratches.tables.bsdf_table import coarser
        from storage.packages import Mesh

        table = self.material.table
        places, shading, facing = stage_view.corners_apart(self.solid)
        corners = np.arange(len(places), dtype=np.uint32).reshape(-1, 3)
        attributes = {"FACING": facing.astype(np.float32)}
        values: dict[str, Any] = {
            "table": coarser(table.rho, stage_view.TABLE_BINS).astype(np.float16),
            "leans": table.leans.astype(np.float32),
            "angles": self.material.layers.angle,
            "coverage": live_parts.coverage_codes(self.material.coverage)[..., None],
            "object": Mesh(places.astype(np.float32), corners, shading, attributes=attributes),
        }
        for name, halfs in self.light.environments.items():
            values[f"environment_{name}"] = halfs.view(np.uint16)
            values[f"lights_{name}"] = stage_view.environment_lights(self.samplers[name])[0]
        return values

    def views(self, size: int) -> tuple[ReferenceView, ...]:
        """The reference views, drawn."""
        from pipelines.glass_scratches.drawing.live_parts import reference_views

        light = self.samplers[self.name]
        return reference_views(self.solid, self._actor(), light, self.light.exposure, size)

    def poster(self) -> NDArray[np.uint8]:
        """The glass under a lamp."""
        from pipelines.glass_scratches.drawing.live_parts import poster

        return poster(self._actor(), self.samplers[self.name], self.light.exposure)

    def _actor(self) -> ScratchedActor:
        from pipelines.glass_scratches.drawing.stage_view import ScratchedActor

        return ScratchedActor(
            self.solid,
            self.material.coverage,
            self.material.layers.angle,
            self.material.table,
            tile=self.light.tile,
        )

    def parameters(self) -> dict[str, Any]:
        """Values by the names of parameters."""
        from pipelines.glass_scratches.drawing import stage_view

        return {
            "refractive_index": self.material.table.refractive_index,
            "keeps_lean": self.material.table.keeps,
            "roughness": self.roughness,
            "tile": self.light.tile,
            "environment": self.name,
            "exposure": self.light.exposure,
            "lamp_edge": list(stage_view.LAMP_EDGE),
            "lamp_colour": list(stage_view.LAMP_COLOUR),
        }

    def contents(
        self,
        names: Sequence[str],
        values: Mapping[str, Any],
        views: Sequence[ReferenceView],
        figures: Sequence[Figure],
        lineage: Sequence[Mapping[str, Any]],
        licence: str,
    ) -> Contents:
        """All of the package; ``names`` of profile, object and environment."""
        from storage.packages import Contents, Source

        built_in = {*SETTINGS, *OBJECTS, *ENVIRONMENTS}
        sources = [
            Source(name, _BUILT_IN if name in built_in else licence or "not stated")
            for name in names
        ]
        shown = [self._view(view) for view in views]
        title = f"{names[0]} on {names[1]}"
        return Contents(title, sources, values, self.parameters(), shown, figures, lineage)

    def _view(self, view: ReferenceView) -> View:
        from storage.packages import View

        size = len(view.frame)
        state = {
            "environment": self.name,
            "turn": 0.0,
            "brightness": 1.0,
            "tilt": 0.0,
            "swing": 0.0,
            "coverage": 1.0,
            "strength": 1.0,
            "tile": self.light.tile,
            "lamp": view.lamp.strength if view.lamp else 0.0,
            "light": list(view.lamp.towards if view.lamp else (0.0, 0.0, 1.0)),
            **{f"layer_{n + 1}": True for n in range(len(self.material.coverage))},
        }
        return View(view.name, f"reference_{view.name}", size, size, 2, asdict(view.camera), state)


def _input(scratch_profile: xr.Dataset) -> NDArray[np.uint8]:
    from pipelines.glass_scratches.drawing.pictures import profile_picture

    return profile_picture(scratch_profile["points"].values)


def _figures(
    scratch_table_2d: xr.Dataset,
    scratch_table: xr.Dataset,
    scratch_layers: xr.Dataset,
    glass_frames: xr.Dataset,
) -> list[Figure]:
    """Figures of the glass, the paper's beside them."""
    from assets_defs.glass_scratches.datasets import table_2d_of
    from pipelines.glass_scratches.figures import energy_error
    from storage.packages import Figure

    share = float(scratch_table["share"].values.mean())
    return [
        Figure("Light that the table loses, at most", energy_error(table_2d_of(scratch_table_2d))),
        Figure("Part of the light that walls do not keep, mean", share),
        Figure("Coverage of a layer, mean", float(scratch_layers["coverage"].values.mean())),
        Figure("Standard error of the traced picture", float(glass_frames["error"].values.mean())),
    ]
