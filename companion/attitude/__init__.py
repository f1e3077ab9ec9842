"""Pure maths of one control step: an attitude and a target in, body rates out.

No I/O, no clock, no configuration, no arrays. The law is that of Xu & Pei, *Attitude Controller for
UAV First-Order Acceleration Coefficients Tracking*, Sensors 2026, 26(9), 2727; equation numbers in
this package are that paper's.
"""

from companion.attitude.limits import Limits
from companion.attitude.planner import LAW_NAMES, PLANNER_NAMES, Planner, make_planner
from companion.attitude.representation import (
    attitude,
    coefficients,
    decompose,
    heading,
    is_unit,
    wrap_angle,
)
from companion.attitude.types import (
    AttitudeError,
    BodyRates,
    Coefficients,
    InvalidBodyRatesError,
    InvalidQuaternionError,
    InvalidTargetError,
    Quaternion,
    Target,
    TiltYaw,
)

__all__ = [
    "LAW_NAMES",
    "PLANNER_NAMES",
    "AttitudeError",
    "BodyRates",
    "Coefficients",
    "InvalidBodyRatesError",
    "InvalidQuaternionError",
    "InvalidTargetError",
    "Limits",
    "Planner",
    "Quaternion",
    "Target",
    "TiltYaw",
    "attitude",
    "coefficients",
    "decompose",
    "heading",
    "is_unit",
    "make_planner",
    "wrap_angle",
]
