"""Looks for causes, round by round, and takes back what others make superfluous."""
