"""Training loops of other projects on our environment, each in an environment of its own."""
