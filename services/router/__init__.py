"""A Zenoh router in a Python process, for sites without zenohd.

Reads and writes no topic itself: it carries all of them.
"""
