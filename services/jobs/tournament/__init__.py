"""`riposte tournament` and `ratings`: everybody of a run against everybody."""
