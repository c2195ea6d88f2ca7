"""Fur from one photograph: cells of a notebook, from a photograph to a picture (docs/fur.md)."""

# %% [markdown]
# Brightness tells how deep in the fur a pixel lies: the photograph is cut into layers, and each
# layer is drawn on a shell around the mesh (docs/fur.md).

# %%
import matplotlib.pyplot as plt
import skimage.data

from pipelines.drawing.colour import decode_srgb
from pipelines.geometry import shapes
from pipelines.photo_fur.frames import ROUND_VIEWS, draw_frames
from pipelines.photo_fur.photograph import fur_photograph
from pipelines.photo_fur.shells import make_shell_mesh

# %% [markdown]
# The photograph: a tabby cat's forehead, in linear light, with the medium read from its histogram.

# %%
forehead = skimage.data.chelsea()[14:78, 88:200]
photograph = fur_photograph(decode_srgb(forehead / 255))
print(photograph.attenuation)

# %% [markdown]
# A teapot with 15 shells, and its picture from the front.

# %%
teapot = make_shell_mesh(shapes.teapot(), 15)
frames = draw_frames(photograph, teapot, ROUND_VIEWS[:1], size=(480, 640))
plt.imshow(frames.pictures[0])
plt.show()
