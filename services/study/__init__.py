"""A study with one person at a time: the runner of its steps, and its two pages."""
