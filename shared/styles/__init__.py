"""How players move: bouts of a tournament, eight features of a bout, ratings, selection."""
