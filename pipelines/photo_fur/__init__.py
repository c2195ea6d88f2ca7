"""Fur from one photograph (docs/fur.md).

Sections and equations named in this package are those of the fur paper that the page cites.
"""
