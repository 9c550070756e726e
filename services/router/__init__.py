"""A Zenoh router in a Python process, for sites without zenohd.

Reads no topic, and writes its own status to every run that it carries.
"""
