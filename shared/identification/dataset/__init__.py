"""Recordings in the form that identification reads; ``docs/dataset.md`` is the contract."""
