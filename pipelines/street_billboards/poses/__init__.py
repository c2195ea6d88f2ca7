"""From frames without poses, or with rough ones, to poses.

1. ``frame_choice`` picks frames of a film by motion, ``still_parts`` masks what stands still in
   them (the bonnet).
2. ``features`` finds and matches SIFT, ``mapping`` makes poses and points of it (pycolmap),
   ``bundle`` adjusts both, ``focal_deviation`` says how well the focal length is told,
   ``joined_pieces`` puts pieces of a long film together; ``found_poses`` does all of 2 by one call.
3. ``adjusted_poses`` improves given poses instead.
4. ``scale`` finds unit, place and up axis, ``drive_quality`` says what a drive is good for;
   ``film_poses`` is the way from pictures to poses in metres.
5. ``worlds`` reads given poses in every way and lets the photographs say which one is right.
"""
