"""A pelt of hairs, photographed from above, whose depths are known.

``pelt``: the whole of it (``make_pelt``) and what is photographed how. ``hairs``: curves grown on a
tile; ``prisms``: what rays meet of them; ``scattering``: light among them, compiled. ``coats``:
such hairs on a body, seen from anywhere under any lamp.
"""
