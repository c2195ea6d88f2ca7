"""Instruments that need no capture: what they measure is known exactly.

``cloth``: a gonioreflectometer and cloths made of yarns. ``pelt``: fur from above with its depth.
``city``: a street, and a car with cameras that drives through it. They are the built-in items of
the systems and what their tests take for the truth; none of them imports a system.
"""
