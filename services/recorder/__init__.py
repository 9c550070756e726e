"""The recorder: turns what is said on the bus into a Rerun recording and a live web view.

Reads ``actor/*/frames``, ``league/progress``, ``league/schedule``, ``status/*/*``, and of live
bouts everything under ``play/`` that is published; writes ``status/recorder/<name>``, and in the
run's folder ``recording.rrd``, ``viewer.json`` and the archive ``bouts/``.
Nobody waits for it: it may fall behind, be killed or run out of disk, and all else goes on.
"""
