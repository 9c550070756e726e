"""Arms that share nothing with the project's own: plain MuJoCo, other shapes, one thing wrong."""
