"""Players written by hand: pure geometry of blades, a pose tracker, and one file per family.

Everything is vectorised over N worlds, component first (``[3, N]``), in the arena frame of the
own side: origin at the target's centre, x towards the other side, z up.
"""
