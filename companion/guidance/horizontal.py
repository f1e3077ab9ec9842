"""Horizontal vectors, and how one is kept short."""

from math import hypot

Horizontal = tuple[float, float]
"""(north, east)."""


def limited(north: float, east: float, most: float) -> Horizontal:
    """The vector, shortened along its direction where it is longer than `most`."""
    length = hypot(north, east)
    if length <= most:
        return north, east
    return north * most / length, east * most / length
