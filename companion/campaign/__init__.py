"""Campaigns: many simulated flights with swept configuration keys, on many processes."""
