"""What can be hidden: a module each, which has ``HIDDEN``. Adding one is one file."""
