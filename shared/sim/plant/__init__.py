"""One arm that replays recorded commands, with whatever identification wants changed in it."""
