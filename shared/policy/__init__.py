"""Policies as values: what they see, what they command, their weights and their artifact."""
