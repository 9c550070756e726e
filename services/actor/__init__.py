"""Plays batches of bouts in MuJoCo and streams rollouts; keeps nothing that a lease cannot replace.

Asks ``league/lease``, ``league/renewal``, ``league/snapshot``, ``league/results``,
``league/settings`` and ``learner/{agent}/rollout``; reads ``learner/{agent}/policy`` and
``league/schedule``; publishes ``actor/{name}/frames``.
"""
