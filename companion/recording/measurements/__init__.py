"""Measurements of a flight: tracking, steps, dead time, and the verdict."""
