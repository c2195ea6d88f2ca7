"""Fur from one photograph (docs/fur.md): the graph's assets and checks.

`declaration` says what the assets are partitioned by, the modules named in `graph` declare them in
the order of the graph, `datasets` goes between stored datasets and the objects of `pipelines`.
"""
