"""Doubles of what is not there in a test or in a lab without it; each behind the real library."""
