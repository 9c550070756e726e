"""Writes data sets with something hidden in them. What it hides, only a judge may read."""
