"""Make docs/pictures/street-film.jpg: a film of the bent city, and the street made of it alone.

``python -m docs.film_pictures`` writes the film into the inbox, runs the graph (ten minutes) and
puts the pictures together.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from assets_defs.launcher import Request
from assets_defs.street_billboards.graph import STREET
from pipelines.drawing.contact_sheet import contact_sheet
from pipelines.street_billboards.drawing.pictures import way_picture
from pipelines.virtual.city.bend import road_bend
from pipelines.virtual.city.city import make_city
from pipelines.virtual.city.drive import expose_photograph, plan_drive
from pipelines.virtual.city.drive_photographs import EXPOSURE
from pipelines.virtual.city.photographing import CityStage
from storage.readers.street_photographs import street_photographs
from storage.versions import VersionedStore
from tsuya.session import launch_all, open_session

PICTURE = Path(__file__).parent / "pictures" / "street-film.jpg"
NAME = "city_bend.mp4"
METRES, DEGREES, FRAMES, SIZE = 80.0, 30.0, 100, (960, 540)
_WIDTH = 1400


def write_film(path: Path) -> None:
    """Ten frames a second of a drive round a bend, H.264."""
    import av

    bend = road_bend(METRES, DEGREES)
    drive = plan_drive(FRAMES, METRES / FRAMES, *SIZE, cameras=1, bend=bend, camera_height=1.5)
    random = np.random.default_rng(3)
    with (
        CityStage(make_city(METRES, 0, bend), street_photographs(), *SIZE) as stage,
        av.open(str(path), "w") as container,
    ):
        stream = container.add_stream("libx264", rate=10)
        stream.width, stream.height, stream.pix_fmt = *SIZE, "yuv420p"
        stream.options = {"crf": "14"}
        for pose in drive.poses[:, 0]:
            light = stage.shoot(drive.intrinsics[0], pose).radiance
            picture = expose_photograph(light, 1.0, EXPOSURE, 0.004, random)
            container.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="rgb24")))
        container.mux(stream.encode())


def film_sheet(store: VersionedStore, key: str) -> NDArray[np.uint8]:
    """The way as it was found; frames held out, the street from there, billboards alone."""
    import cv2

    def stored(asset: str):  # type: ignore[no-untyped-def]
        return store.open(STREET.slot(asset, {"drive": key}))

    poses, frames = stored("drive_poses"), stored("street_frames")
    places = poses["poses"].values[..., :3, 3]
    way = way_picture(places, poses["points"].values, poses["point_colours"].values)
    shown = [
        frames[name].values[number]
        for number in (0, len(frames["truth"]) - 1)
        for name in ("truth", "rendered", "alone")
    ]
    parts = [way, contact_sheet(np.stack(shown))]
    scaled = [
        cv2.resize(part, (_WIDTH, part.shape[0] * _WIDTH // part.shape[1]), None, 0, 0, 3)
        for part in parts
    ]
    return np.vstack(scaled).astype(np.uint8)


def main() -> None:
    """Film, graph, picture."""
    from PIL import Image

    with open_session() as session:
        inbox = session.workspace.inbox("street_billboards")
        inbox.mkdir(parents=True, exist_ok=True)
        if not (inbox / NAME).exists():
            write_film(inbox / NAME)
        (key,) = (key for key, one in STREET.sources("drive", inbox).items() if one.name == NAME)
        launch_all(session, [Request(STREET, [{"drive": key}], "demo")])
        sheet = film_sheet(session.workspace.store, key)
    Image.fromarray(sheet).save(PICTURE, quality=88)


if __name__ == "__main__":
    main()
