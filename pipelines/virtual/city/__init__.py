"""A street of houses, trees and cars, and a car with cameras that drives through it.

``city``: the street from a seed (``make_city``), of ``facades``, ``furniture`` and ``cars``, which
are put together from ``parts``; ``bend``: a road that is not straight. ``materials``: textures from
photographs; ``light``: what arrives of the overcast ``sky``; ``reflections``: what panes mirror.
``photographing``: radiance, depth and poles from a camera (``CityStage``). ``drive``: where cameras
are and how they expose (``plan_drive``); ``drive_photographs``: all that they take.
"""
