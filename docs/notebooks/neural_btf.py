"""Neural BTFs: cells of a notebook, from a virtual cloth to a picture (docs/btf.md)."""

# %% [markdown]
# A BTF is photographs of a material under every pair of light and view. Here it becomes a small
# network and eight numbers a texel, which any direction can be asked for.

# %%
import matplotlib.pyplot as plt
import numpy as np

from pipelines.light.directions import all_pairs, hemisphere_table
from pipelines.neural_btf.compression import TrainingPlan, compress_photographs
from pipelines.neural_btf.panel import draw_frames, moving_lights
from pipelines.virtual.cloth.gonioreflectometer import Gonioreflectometer
from pipelines.virtual.cloth.weaves import make_cloth

# %% [markdown]
# A tile of corduroy on the virtual gonioreflectometer: 15 views under 15 lights each.

# %%
directions = hemisphere_table(15)
gonio = Gonioreflectometer(make_cloth("corduroy", seed=0), directions, (24, 24), bounces=0)
photographs = np.concatenate([gonio.photographs(view) for view in directions])

# %% [markdown]
# The network, and a folded panel of the cloth decoded from it.

# %%
plan = TrainingPlan(steps=100, rate=0.02, batch_texels=32, batch_images=16)
btf = compress_photographs(photographs, all_pairs(directions, directions), plan=plan)
plt.imshow(draw_frames(btf, moving_lights(1)).pictures[0])
plt.show()
