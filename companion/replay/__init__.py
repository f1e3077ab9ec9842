"""Runs the code of a flight again with the inputs that the flight recorded."""
