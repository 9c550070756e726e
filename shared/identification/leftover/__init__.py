"""What a model does not explain: where, when, and whether something pushed."""
