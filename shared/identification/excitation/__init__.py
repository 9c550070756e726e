"""Designs what to record: motions within limits, and what they will show before they are played."""
