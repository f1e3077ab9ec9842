"""Maths of the outer loop: maneuvers, the acceleration that follows them, and the thrust.

Nothing here reads or writes anything, except that `trajectory.csv_file` reads a file.
"""

from companion.guidance.doublets import Doublets
from companion.guidance.drag_estimate import DragEstimate
from companion.guidance.feedback import HeightGains, Weights, horizontal_gains
from companion.guidance.hover_thrust import HoverThrust, ThrustSettings
from companion.guidance.inner_response import IMMEDIATE, InnerResponse
from companion.guidance.linear import GuidanceInput, LinearCommand, LinearGuidance, LinearSettings
from companion.guidance.maneuvers import Corners, Maneuver, ManeuverSequence, Steps
from companion.guidance.motion_observer import MotionObserver, ObserverSettings
from companion.guidance.reference import GRAVITY, Pose, Reference, VehicleMotion

__all__ = [
    "GRAVITY",
    "IMMEDIATE",
    "Corners",
    "Doublets",
    "DragEstimate",
    "GuidanceInput",
    "HeightGains",
    "HoverThrust",
    "InnerResponse",
    "LinearCommand",
    "LinearGuidance",
    "LinearSettings",
    "Maneuver",
    "ManeuverSequence",
    "MotionObserver",
    "ObserverSettings",
    "Pose",
    "Reference",
    "Steps",
    "ThrustSettings",
    "VehicleMotion",
    "Weights",
    "horizontal_gains",
]
