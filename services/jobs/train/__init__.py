"""`riposte train`: from the command line to the last process."""
