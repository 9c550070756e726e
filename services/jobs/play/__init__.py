"""`riposte play`: a match on this machine, from its plan to its summary."""
