"""Studies with people: protocols, orders, what a session writes, and what its tables hold."""
