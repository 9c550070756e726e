"""Torques and motions that several effects of the catalogue are made of."""
