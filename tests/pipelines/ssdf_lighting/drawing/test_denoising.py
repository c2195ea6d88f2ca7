"""Denoised pictures against traced ones of many more rays."""

import numpy as np

from pipelines.light.built_in_environments import lamps
from pipelines.ssdf_lighting.drawing.denoising import denoised
from pipelines.ssdf_lighting.drawing.light_sources import ProbeSource
from pipelines.ssdf_lighting.drawing.ray_tracing import Traced, ray_traced
from pipelines.ssdf_lighting.drawing.viewpoints import viewpoint
from pipelines.ssdf_lighting.scene import built_in_scene, split_by_part

SIZE = (96, 72)


def test_a_denoised_picture_of_few_rays_is_near_that_of_many() -> None:
    scene = built_in_scene("court", 6, 16)
    mesh, camera = split_by_part(scene).mesh, viewpoint(scene, None, None, 4 / 3).camera
    source = ProbeSource(lamps(64))

    def traced(samples: int, seed: int) -> Traced:
        return ray_traced(mesh, source, camera, SIZE, samples, seed=seed, jittered=False)

    few, many = (traced(*given).radiance[..., :3] for given in ((8, 0), (512, 1)))
    clean = denoised(few, mesh, camera, SIZE)

    def error(picture: np.ndarray) -> float:
        return float(np.sqrt(np.mean((picture - many) ** 2)))

    assert error(clean) < 0.5 * error(few)
    # A null: pixels averaged without knowing where surfaces end.
    around = sum(np.roll(few, (y, x), (0, 1)) for y in (-1, 0, 1) for x in (-1, 0, 1)) / 9.0
    assert error(clean) < 0.75 * error(np.asarray(around))
    assert (clean >= 0.0).all()
    assert abs(clean.mean() / many.mean() - 1.0) < 0.02
