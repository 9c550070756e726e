"""`riposte study`: studies with people, from the protocol to the tables of the paper."""
