"""Other ways to carry acknowledged messages between two processes of one machine."""
