"""Serves what the processes of a run say of themselves to Prometheus, as text over HTTP.

Reads ``status/{role}/{name}`` and ``league/progress``; writes its own status. Nothing it hears is
executed, stored or passed on but as numbers and short, escaped labels.
"""
