"""Measurements behind every claim of speed and learning; `riposte bench` runs them by name."""
