"""How a vehicle answers body rates and thrust, from what a flight has recorded; needs only NumPy.

The time of a command is the vehicle time of the sample it answered. So a dead time found here is
the time from a sample to the first effect of its answer, as `vehicle.dead_time_ms` is.
"""

from companion.identification.correlation import dead_time_by_correlation
from companion.identification.delayed_model import SecondOrderFit
from companion.identification.fragment import kept_axes, vehicle_fragment
from companion.identification.response import (
    BadFitError,
    FitNeeds,
    FitQuality,
    RateResponse,
    fit_rate_response,
)
from companion.identification.thrust_map import ThrustMap, fit_thrust_map
from companion.identification.vehicle import IdentifiedVehicle, identify_vehicle, vehicle_table

__all__ = [
    "BadFitError",
    "FitNeeds",
    "FitQuality",
    "IdentifiedVehicle",
    "RateResponse",
    "SecondOrderFit",
    "ThrustMap",
    "dead_time_by_correlation",
    "fit_rate_response",
    "fit_thrust_map",
    "identify_vehicle",
    "kept_axes",
    "vehicle_fragment",
    "vehicle_table",
]
