"""The processes of Riposte: whatever owns a loop, a socket or a signal handler."""
