"""The tones of the score: made, and played by a process of their own."""
