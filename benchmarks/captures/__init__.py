"""Files as people really have them, and what is to become of each: read, told, or refused.

A module a kind of file (``light_probes``, ``photographs`` …) lists ``CASES``; ``files/`` holds
those that were met as files and are kept as they are.
"""
