"""The robot under faults: a match, what goes wrong in it, and the rules that must hold."""
