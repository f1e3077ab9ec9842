"""Runs the code of a flight again over what the flight recorded."""
