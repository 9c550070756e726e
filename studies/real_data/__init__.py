"""Turns public recordings of real arms into data sets for ``riposte identify``.

The recordings are not part of the project: each module is told where they lie.
"""
