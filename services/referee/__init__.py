"""The referee: scores a live bout from bat poses; simulation, laptop and robot alike.

Reads ``play/bats``, answers ``play/bout`` and writes ``play/referee`` and
``status/referee/<name>``. It holds no device and waits for nobody: without bat states the bout
pauses, then is void. The rules are those of ``shared/game``, which the actors call too.
"""
