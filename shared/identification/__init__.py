"""Finds what a simulation gets wrong and names the cause, or says that it does not know."""
