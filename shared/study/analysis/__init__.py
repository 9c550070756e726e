"""What a study's recordings say: the paper's statistics, their assumptions, and a report of both.

Tests are pure functions on numpy arrays that return a ``Finding``; a chapter turns the tables of a
study folder into findings, tables and pictures; a page shows chapters.
"""
