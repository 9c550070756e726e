"""Hours of training and play together: what is sampled, and what is made of it."""
