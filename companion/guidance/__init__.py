"""Pure maths of the outer loop: what to fly, which acceleration that takes, and how much thrust."""

from companion.guidance.hold import HoldGains, PositionHold
from companion.guidance.programmes import Circle, Corners, Hover, Programme, Sequence, Steps
from companion.guidance.reference import Pose, Reference, VehicleMotion
from companion.guidance.thrust import HoverThrust, specific_thrust

__all__ = [
    "Circle",
    "Corners",
    "HoldGains",
    "Hover",
    "HoverThrust",
    "Pose",
    "PositionHold",
    "Programme",
    "Reference",
    "Sequence",
    "Steps",
    "VehicleMotion",
    "specific_thrust",
]
