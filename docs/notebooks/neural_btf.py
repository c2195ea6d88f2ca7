"""Neural BTFs: cells of a notebook, from a virtual cloth to a picture (docs/btf.md)."""

# %% [markdown]
# A BTF is photographs of a material under every pair of light and view. Here it becomes a small
# network and eight numbers a texel, which any direction can be asked for.

# %%
import matplotlib.pyplot as plt
import numpy as np

from pipelines.light.directions import all_pairs, hemisphere_table
from pipelines.neural_btf.compression import TrainingPlan, compress_photographs
from pipelines.neural_btf.draping.frames import Shots, draw_frames
from pipelines.virtual.cloth.gonioreflectometer import Gonioreflectometer
from pipelines.virtual.cloth.weaves import make_cloth

# %% [markdown]
# A tile of corduroy on the virtual gonioreflectometer: 15 views under 15 lights each.

# %%
directions = hemisphere_table(15)
gonio = Gonioreflectometer(make_cloth("corduroy", seed=0), directions, (24, 24), bounces=0)
photographs = np.concatenate([gonio.photographs(view) for view in directions])

# %% [markdown]
# The network, and a draped cloth decoded from it, close by.

# %%
plan = TrainingPlan(steps=100, rate=0.02, batch_texels=32, batch_images=16)
pairs = all_pairs(directions, directions)
btf = compress_photographs(photographs, pairs, plan=plan)
plt.imshow(draw_frames(btf, photographs, pairs, Shots(320, 8, 1, 20)).closeup)
plt.show()
