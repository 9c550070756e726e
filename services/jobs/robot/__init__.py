"""`riposte robot`: what a person does with a robot: check, arm, disarm, reset, calibrate."""
