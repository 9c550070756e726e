"""`riposte doctor`: what this machine has, and what to do about the rest."""
