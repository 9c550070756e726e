"""What is being identified: one arm, what its recordings reach, and how they are replayed."""
