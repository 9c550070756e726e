"""What two recordings of the same commands differ by, and how far that is carried on."""
