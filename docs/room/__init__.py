"""The room that `pipelines.light.room` holds as a map: its furniture, its light, its picture.

``python -m docs.room`` makes pipelines/light/room.exr anew, in some minutes.
"""
