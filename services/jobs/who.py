"""Who sits at this terminal."""

import getpass
import os


def operator() -> str:
    """Return the name under which a person's acts are logged."""
    try:
        return getpass.getuser()
    except (OSError, KeyError):  # no name in a container
        return f"user {os.getuid()}"
