"""`riposte identify`: what a simulation gets wrong, why, and by how much naming it helps."""
