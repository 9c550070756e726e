"""The fencing game: its geometry, its rules and the course of a bout, as pure functions."""
