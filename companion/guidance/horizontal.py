"""Horizontal vectors: how one is kept short, and how one is turned."""

from math import cos, hypot, sin

Horizontal = tuple[float, float]
"""(north, east)."""


def limited(north: float, east: float, most: float) -> Horizontal:
    """The vector, shortened along its direction where it is longer than `most`."""
    length = hypot(north, east)
    if length <= most:
        return north, east
    return north * most / length, east * most / length


def rotated(north: float, east: float, angle: float) -> Horizontal:
    """The vector turned clockwise, seen from above, by an angle in rad."""
    c, s = cos(angle), sin(angle)
    return c * north - s * east, s * north + c * east
