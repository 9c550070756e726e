"""Hide an effect in the twin, find it, train with it, measure the gain in play."""
