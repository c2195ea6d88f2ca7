"""Image-based lighting by SSDFs: cells of a notebook, from a scene to a picture (docs/ssdf.md)."""

# %% [markdown]
# Every vertex knows how far each direction is from the edge of the sky. A light that is a spherical
# Gaussian is then seen in part by a formula, and nothing is traced any more when the light turns.

# %%
import matplotlib.pyplot as plt

from pipelines.light.built_in_environments import sky
from pipelines.ssdf_lighting.compression import compact_file, decoder
from pipelines.ssdf_lighting.distances.refined import scene_distances
from pipelines.ssdf_lighting.drawing import frames, viewpoints
from pipelines.ssdf_lighting.light.environment_fit import fit_lights
from pipelines.ssdf_lighting.scene import built_in_scene

# %% [markdown]
# The teapot's distances along 32 x 32 directions, 8 MB, and a file of 43 kB instead.

# %%
scene = built_in_scene("teapot", segments=6, floor=20)
matrix = scene_distances(scene.vertices, scene.triangles, scene.normals, 32)
file = compact_file.compress(matrix, scene.triangles, clusters=24, rmse=0.02)

# %% [markdown]
# A sky with its sun as four lights, and the teapot under it, lit from the file.

# %%
lights = fit_lights(sky(32, sun_azimuth=25.0, sun_elevation=35.0), 4).lights
camera, basis = viewpoints.scene_camera(scene, -62, 24, 4 / 3), decoder.Decoder.of_file(file)
turn = frames.draw_turning_light(scene, lights, basis.distances_along, camera, (480, 360), [0.0])
plt.imshow(frames.exposed(turn.radiance[0], frames.scene_exposure(turn)))
plt.show()
