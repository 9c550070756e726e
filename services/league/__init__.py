"""The league: who learns against whom, the ledger of everything that happened, the snapshot store.

Reads nothing by itself. Answers ``league/lease``, ``league/renewal``, ``league/results``,
``league/version``, ``league/incident``, ``league/snapshot`` and ``league/settings``; writes
``league/schedule``, ``league/leases`` and ``league/progress``.
"""
