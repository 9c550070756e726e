"""The base and what is beside it, fitted to recordings."""
