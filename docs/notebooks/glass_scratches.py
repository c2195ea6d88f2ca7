"""Scratched glass: cells of a notebook, from a cross-section to a picture (docs/scratches.md)."""

# %% [markdown]
# A scratch is a groove. What its walls do to light is a table; scratches with that table lie on a
# tile, the tile is laid on a solid of glass, and paths of light are traced through it.

# %%
import matplotlib.pyplot as plt

from pipelines.geometry.solid_shapes import plate
from pipelines.glass_scratches import scratched_glass as glass
from pipelines.glass_scratches.drawing import denoising, frames
from pipelines.glass_scratches.layers import scratch_layers, settings
from pipelines.glass_scratches.tables import glass_table, profiles
from pipelines.light import environment_sampling, room

# %% [markdown] A V in glass, its walls scatter evenly, 10 µm wide and 4 deep; four layers of such
# scratches; a plate with them.

# %%
table = glass_table.glass_table(profiles.built_in_profile("v", 10, 4), bins=64, index=1.5)
layers = scratch_layers.make_layers(settings.LayerSpec(length=0.6, width=0.01), seed=3)
pane = glass.scratched_glass(plate(1.5, 1.1, 0.05), glass.scratch_material(table, layers))

# %% [markdown]
# A hand's breadth from the plate, in a room: 16 paths of light a pixel, and their noise taken away.

# %%
light = environment_sampling.make_environment_sampler(room.room(512))
traced = frames.trace_view(pane, light, frames.object_cameras(pane.solid)[1], size=180, samples=16)
clean = denoising.denoised(traced)
plt.imshow((clean * frames.picture_exposure(clean)).clip(0, 1) ** (1 / 2.2))
plt.show()
