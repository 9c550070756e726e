"""A study with one person at a time: the runner of its steps, and its two pages.

Reads ``play/bats``, ``play/gate``, ``play/referee``, ``play/heart_rate`` and ``status/*/*``; asks
``play/protagonist/player``, ``play/bout`` and ``play/arm``; writes ``status/study/<name>``, and in
the session's folder the journal, the tables, ``study.json`` and ``researcher.token``. It moves
nothing and scores nothing, and it arms the robot only when the researcher says so.
"""
