"""`riposte styles`: how protagonists move, and which three to send."""
