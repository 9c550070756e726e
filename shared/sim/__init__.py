"""The physics: two PR2 robots with a bat each, many worlds at a time; the door to MuJoCo."""
