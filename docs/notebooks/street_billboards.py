"""Streets from billboards: cells of a notebook, from photographs to a picture (docs/street.md)."""

# %% [markdown]
# Cameras side by side tell depth; where points lie together stands a billboard, and its textures
# are those of the photographs that see it best. Then one may look from where nobody stood.

# %%
import matplotlib.pyplot as plt
import numpy as np
import skimage.data

from pipelines.geometry.cameras import moved_left
from pipelines.street_billboards.capture.drive_depth import RigFrame
from pipelines.street_billboards.frames import draw_view
from pipelines.street_billboards.whole_street import street_of_frames

# %% [markdown]
# A real pair, a third of its size: two cameras 19 cm apart that look along y, z is up.

# %%
photographs = np.stack(skimage.data.stereo_motorcycle()[:2])[:, ::3, ::3]
lens = np.array([[331.7, 0, 123], [0, 331.7, 83], [0, 0, 1]])
lenses = np.stack([lens - np.eye(3, k=2) * off for off in (19.3, 8.9)])
pose = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])
frame = RigFrame(photographs, lenses, np.stack([pose, moved_left(pose, -0.193)]))

# %% [markdown]
# Billboards of 12 cm, seen from 30 cm farther to the right.

# %%
street = street_of_frames([frame], voxel=0.12, nearest=1.5)
plt.imshow(draw_view(street, lens, moved_left(pose, -0.3), (247, 167)))
plt.show()
