"""Simulated participants: how they move, learn, tire and answer. They are not people.

What is assumed of them, with sources and with what is invented: ``docs/rehearsal.md``.
"""
