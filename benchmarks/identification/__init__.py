"""What the benchmark of identification is made of."""
