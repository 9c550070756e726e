"""The recorder: turns what is said on the bus into a Rerun recording and a live web view.

Reads ``actor/*/frames``, ``league/progress``, ``league/schedule`` and ``status/*/*``; writes
``status/recorder/<name>``, and in the run's folder ``recording.rrd`` and ``viewer.json``.
Nobody waits for it: it may fall behind, be killed or run out of disk, and training goes on.
"""
