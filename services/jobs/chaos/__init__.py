"""`riposte chaos`: named faults in a running job, and what they cost; knows every service."""
