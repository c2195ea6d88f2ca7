"""A gonioreflectometer, and cloths made of yarns to lay on it.

``weaves``: silk, twill, knit and corduroy (``make_cloth``), built of ``yarns`` into one ``mesh``.
``gonioreflectometer``: photographs of a cloth from every view under every light, by the compiled
loops of ``shading`` and ``interreflection`` with the ``fibre_brdf``.
"""
