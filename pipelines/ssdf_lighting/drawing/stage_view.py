"""The lit mesh on the stage: lobes at the vertices on the processor, all else in a shader.

A frame: the axes of all lobes at the vertices follow from normals, view and lights; the caller
says how far the edge of the visible sky is there; these distances become vertex attributes, four
in a vector, and are interpolated. A pixel makes its own lobes of the interpolated normal and its
view, and takes their visible shares (as ``shading.shaded``; the table as a formula,
:mod:`.edge_share`).

Nothing is built anew for a frame: distances are written into the arrays of the mesh, lights and
the eye are uniforms (whose values, other than their names, VTK changes without a new shader: seen).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipelines.drawing.glsl import surface_shader
from pipelines.drawing.stage import Camera, Stage, surface
from pipelines.ssdf_lighting.distances.edge_share import edge_share
from pipelines.ssdf_lighting.drawing.camera_rays import eye
from pipelines.ssdf_lighting.drawing.finishes import Finish, finishes, fixed
from pipelines.ssdf_lighting.drawing.numpy_view import DistancesAt
from pipelines.ssdf_lighting.drawing.textured_vertices import vertex_looks
from pipelines.ssdf_lighting.light.cosine_lobes import CosineLobes
from pipelines.ssdf_lighting.light.gloss_grid import gloss_grid, nearest_rows
from pipelines.ssdf_lighting.light.gloss_lobes import GlossLobes
from pipelines.ssdf_lighting.light.lobe_axes import AxisTables, lobe_axes
from pipelines.ssdf_lighting.light.shading import LobeTables, lobe_tables
from pipelines.ssdf_lighting.light.spherical_gaussians import Lights
from pipelines.ssdf_lighting.scene import LitMesh

MOST_LIGHTS = 24
"""Two lobes a light, four distances an attribute: 12 of OpenGL's 16 attributes, and position,
normal, bounced light and one or two of the material."""
_FINE = 2048
"""Steps of n·p in the shader's table of the matt part: the nearest is taken, no two are mixed."""


class LitActor:
    """A mesh on the stage, lit by N <= 24 spherical Gaussians.

    lights: those of the first frame; others of the same number may follow.

    ``actors`` are for ``Stage.add``: all that is glossy, then all that is not. Software renderers
    take both sides of a branch; so what has no gloss has a shader without. Raises ValueError for
    more lights, as ``lobe_tables`` does, and for objects that have no material.
    """

    def __init__(self, mesh: LitMesh, lights: Lights) -> None:
        count = len(lights.sharpness)
        if not 1 <= count <= MOST_LIGHTS:
            raise ValueError(f"there are {count} lights; expected 1 to {MOST_LIGHTS} on the stage.")
        objects, materials = np.asarray(mesh.object_of_vertex), mesh.materials
        if objects.size and not 0 <= objects.min() <= objects.max() < len(materials.specular):
            raise ValueError(
                f"object_of_vertex: found {objects.min()} to {objects.max()}, expected rows of "
                f"{len(materials.specular)} materials."
            )
        self._materials = materials
        self._points = np.ascontiguousarray(mesh.vertices, np.float32)
        self._normals = np.ascontiguousarray(mesh.normals, np.float32)
        self._sharpness = np.array(lights.sharpness)
        tables = lobe_tables(materials, lights)
        self._rows = rows_of_lobes(mesh)
        self._axis_tables = self._make_axis_tables(tables)
        corners = np.asarray(mesh.triangles)
        self._parts = [
            _Part(self._points, corners, self._normals, tables.cosine, finish)
            for finish in finishes(mesh, tables.gloss)
        ]
        self.actors = [part.actor for part in self._parts]
        self._set_lights(np.zeros(4), lights)

    def relight(self, camera: Camera, lights: Lights, distances_at: DistancesAt) -> None:
        """Make the next frame show this view and these lights.

        ``distances_at`` gets the axes (V, 2 N, 3) float32 of the lobes at the vertices, zeros where
        there is no gloss, and returns d (V, 2 N), radians. Raises ValueError for another number of
        lights than before and for distances of another shape.
        """
        if len(lights.sharpness) != len(self._sharpness):
            raise ValueError(
                f"there are {len(lights.sharpness)} lights; expected {len(self._sharpness)}."
            )
        if not np.array_equal(lights.sharpness, self._sharpness):
            self._sharpness = np.array(lights.sharpness)
            tables = lobe_tables(self._materials, lights)
            self._axis_tables = self._make_axis_tables(tables)
            for part in self._parts:
                part.show_tables(tables)
        self.show_distances(distances_at(self.axes(camera, lights)))
        self._set_lights(eye(camera), lights)

    def axes(self, camera: Camera, lights: Lights) -> NDArray[np.float32]:
        """Axes (V, 2 N, 3) float32 of the lobes at the vertices."""
        return lobe_axes(
            self._points, self._normals, self._rows, eye(camera), self._axis_tables, lights
        )

    def show_distances(self, distances: NDArray[np.floating]) -> None:
        """Put distances (V, 2 N) at the lobes' axes into the vertex attributes."""
        expected = (len(self._points), 2 * len(self._sharpness))
        if distances.shape != expected:
            raise ValueError(f"distances: found shape {distances.shape}, expected {expected}.")
        for part in self._parts:
            part.show_distances(distances)

    def show_bounced(self, light: NDArray[np.floating]) -> None:
        """Add light that other surfaces reflect: (V, 3), what albedo 1 would show of it."""
        expected = (len(self._points), 3)
        if light.shape != expected:
            raise ValueError(f"bounced light: found shape {light.shape}, expected {expected}.")
        for part in self._parts:
            part.show_bounced(light)

    def _set_lights(self, seen_from: NDArray[np.float64], lights: Lights) -> None:
        for part in self._parts:
            part.set_lights(seen_from, lights)

    def _make_axis_tables(self, tables: LobeTables) -> AxisTables:
        """Rows of the materials, behind them those of the table for what has textures."""
        has_gloss = self._materials.specular > 0
        if self._rows.max(initial=0) < len(has_gloss):
            return AxisTables(tables, has_gloss)
        gloss = all_gloss_lobes(tables.gloss)
        has_gloss = np.append(has_gloss, np.ones(len(gloss.along) - len(has_gloss), bool))
        return AxisTables(LobeTables(tables.cosine, gloss), has_gloss)


def all_gloss_lobes(of_materials: GlossLobes) -> GlossLobes:
    """Rows of the materials, behind them those of the table for what has textures."""
    both = zip(of_materials, gloss_grid(), strict=True)
    return GlossLobes(*(np.concatenate(rows) for rows in both))


def rows_of_lobes(mesh: LitMesh) -> NDArray[np.int32]:
    """(V,): whose lobes the vertices have: their material's, or, behind the materials, the row of
    the table that is nearest to what their textures say."""
    rows = np.array(mesh.object_of_vertex, np.int32)
    for vertices, looks in vertex_looks(mesh):
        if looks.specular.any():
            found = nearest_rows(looks.specular, looks.roughness)
            rows[vertices] = found + len(mesh.materials.specular)
    return rows


class _Part:
    """The triangles of a lit mesh that share a shader; only their vertices."""

    def __init__(
        self,
        points: NDArray[np.float32],
        triangles: NDArray[np.integer],
        normals: NDArray[np.float32],
        cosine: CosineLobes,
        finish: Finish,
    ) -> None:
        self._chosen, corners = np.unique(triangles[finish.triangles], return_inverse=True)
        self._count = count = len(cosine.irradiance)
        self._matt = fixed(matt_rows(cosine))
        names = [f"edge{number}" for number in range(-(-count // 4) * (1 + finish.has_gloss))]
        self.actor = surface(
            points[self._chosen],
            corners.reshape(-1, 3),
            attributes={
                **_packed(normals[self._chosen], finish, self._chosen),
                # Each its own: the mesh keeps them, and they are written to.
                **{name: np.zeros((len(self._chosen), 4), np.float32) for name in names},
            },
            textures={"matt": self._matt, **finish.textures},
            shader=surface_shader(
                "lit_vertex.glsl",
                "lit_fragment.glsl",
                LIGHTS=count,
                EDGES=len(names),
                MATT_HALF=_FINE / 2,
                EDGES_FETCHED=False,
                **finish.values,
            ),
            lit=False,
        )
        self._arrays, self._edges = _arrays_of(self.actor, names)
        self._normals = normals[self._chosen]
        self._room = ["shading", "paint"] if "paint" in finish.attributes else ["bounced"]
        self._uniforms = self.actor.GetShaderProperty().GetFragmentCustomUniforms()
        for name, values in finish.uniforms.items():
            self._uniforms.SetUniform4f(name, values)

    def show_tables(self, tables: LobeTables) -> None:
        _memory_of(self._matt)[:] = matt_rows(tables.cosine)
        self._matt.GetInput().GetPointData().GetScalars().Modified()
        self._matt.GetInput().Modified()

    def show_distances(self, distances: NDArray[np.floating]) -> None:
        groups = -(-self._count // 4)
        for number, (array, values) in enumerate(zip(self._arrays, self._edges, strict=True)):
            half, group = divmod(number, groups)
            width = min(4, self._count - 4 * group)
            first = half * self._count + 4 * group
            values[:, :width] = distances[self._chosen, first : first + width]
            array.Modified()

    def show_bounced(self, light: NDArray[np.floating]) -> None:
        chosen = light[self._chosen]
        arrays, values = _arrays_of(self.actor, self._room)
        if len(values) == 1:
            values[0][:] = chosen
        else:
            values[0][:, :3] = self._normals * (1.0 + chosen[:, 2:])
            values[0][:, 3], values[1][:, 3] = chosen[:, 0], chosen[:, 1]
        for array in arrays:
            array.Modified()

    def set_lights(self, seen_from: NDArray[np.float64], lights: Lights) -> None:
        rows = np.column_stack([lights.axes, lights.sharpness])
        self._uniforms.SetUniform4f("eye", seen_from.tolist())
        for name, values in (("lights", rows), ("amplitudes", lights.amplitudes)):
            self._uniforms.SetUniform1fv(name, values.size, values.ravel().tolist())


def _packed(
    normals: NDArray[np.float32], finish: Finish, chosen: NDArray[np.integer]
) -> dict[str, NDArray[Any]]:
    """Attributes besides the distances, with room for reflected light: see lit_vertex.glsl."""
    others = {name: values[chosen] for name, values in finish.attributes.items()}
    none = np.zeros((len(chosen), 3), np.float32)
    if "paint" not in others:
        return {"shading": normals, "bounced": none, **others}
    with_room = {"shading": normals, "paint": others.pop("paint").astype(np.float32)}
    packed = {name: np.hstack([values, none[:, :1]]) for name, values in with_room.items()}
    return {**packed, **others}


def draw_lit(
    stage: Stage | tuple[int, int],
    actor: LitActor,
    camera: Camera,
    lights: Lights,
    distances_at: DistancesAt,
) -> NDArray[np.float32]:
    """Linear radiance and coverage (height, width, 4) of the lit mesh.

    ``stage`` is the one that holds ``actor.actors``, or the size (width, height) of a new one for
    this picture alone. Raises ValueError as ``LitActor.relight``.
    """
    if not isinstance(stage, Stage):
        with Stage(*stage) as made:
            made.add(*actor.actors)
            return draw_lit(made, actor, camera, lights, distances_at)
    actor.relight(camera, lights, distances_at)
    stage.look(camera)
    return stage.radiance()


# ---- tables and memory of the graphics library -------------------------------------------------


def matt_rows(lobes: CosineLobes) -> NDArray[np.float32]:
    """(N, _FINE + 1, 3): irradiance / pi, sqrt(1 + λ), 1 / share at the horizon."""
    cosine = np.linspace(-1.0, 1.0, lobes.irradiance.shape[1])
    horizon = np.arcsin(np.clip(lobes.along * cosine + lobes.up, -1.0, 1.0))
    whole = edge_share(horizon, lobes.sharpness)
    coarse = np.stack([lobes.irradiance / np.pi, np.sqrt(1 + lobes.sharpness), 1 / whole])
    place = np.linspace(0.0, coarse.shape[2] - 1.0, _FINE + 1)
    left = np.minimum(place.astype(np.int64), coarse.shape[2] - 2)
    fine = coarse[..., left] + (place - left) * (coarse[..., left + 1] - coarse[..., left])
    return np.moveaxis(fine, 0, -1).astype(np.float32)


def _memory_of(made: Any) -> NDArray[np.float32]:
    """The texels (row, column, channel) of a texture, row 0 at t = 0; writing changes them."""
    from vtkmodules.util.numpy_support import vtk_to_numpy

    image = made.GetInput()
    width, height, _ = image.GetDimensions()
    texels: NDArray[np.float32] = vtk_to_numpy(image.GetPointData().GetScalars())
    return texels.reshape(height, width, -1)


def _arrays_of(actor: Any, names: list[str]) -> tuple[list[Any], list[NDArray[np.float32]]]:
    """The named vertex attributes, and their values (V, k); writing changes them."""
    from vtkmodules.util.numpy_support import vtk_to_numpy

    points = actor.GetMapper().GetInput().GetPointData()
    arrays = [points.GetArray(name) for name in names]
    return arrays, [vtk_to_numpy(array) for array in arrays]
