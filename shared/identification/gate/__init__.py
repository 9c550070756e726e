"""Whether recordings say that there is any of a cause: held-out ones, and all together."""
