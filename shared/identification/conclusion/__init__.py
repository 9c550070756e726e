"""Puts what was found into words, numbers, pictures' data and a model file."""
