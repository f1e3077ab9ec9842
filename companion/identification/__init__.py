"""Identifies a vehicle's response to body rates and thrust from a recorded flight, with NumPy.

    >>> import numpy as np
    >>> from companion.identification import fit_rate_response
    >>> time = np.arange(0.0, 20.0, 0.004)
    >>> commanded = np.sign(np.sin(2.0 * time))  # rad/s, to and fro
    >>> measured = np.zeros_like(time)  # it follows with a lag of 50 ms, 40 ms later
    >>> for k in range(10, time.size - 1):
    ...     measured[k + 1] = measured[k] + 0.004 / 0.05 * (commanded[k - 10] - measured[k])
    >>> fit = fit_rate_response(time, commanded, time, measured)
    >>> round(fit.lag, 2), round(fit.dead_time, 2), fit.is_good()
    (0.05, 0.04, True)

The time of a command is the vehicle time of the sample to which it responds. The dead time found
here is therefore from a sample to the first effect of its command, like `vehicle.dead_time_ms`.
`companion.vehicle.flight_log.read_flight_log` gives the rows of a `.tlog`.

A whole vehicle
    identify_vehicle          fits each axis and the thrust: an `IdentifiedVehicle`
    IdentifiedVehicle         roll, pitch, yaw, thrust; `flaws` says which fits must not be used
    vehicle_table             the fits as a table for the terminal
    vehicle_fragment          the fits as YAML for a configuration
    kept_axes                 configured values of the axes whose fit is bad

One axis
    fit_rate_response         lag, dead time, gain and slew limit: a `RateResponse`
    RateResponse              the fit; `is_good` and `flaw` say whether it may be used
    FitQuality, FitNeeds      how good a fit is, and how good it must be
    SecondOrderFit            the second-order response that fits best
    BadFitError               raised if bad fits leave an axis without values
    dead_time_by_correlation  the dead time alone, by cross-correlation

Thrust
    fit_thrust_map            specific thrust over thrust 0..1: a `ThrustMap`
    ThrustMap                 slope, offset, lag and dead time
"""

# Without `__all__`: see `companion.attitude`.
from companion.identification.correlation import (
    dead_time_by_correlation as dead_time_by_correlation,
)
from companion.identification.delayed_model import SecondOrderFit as SecondOrderFit
from companion.identification.fragment import kept_axes as kept_axes
from companion.identification.fragment import vehicle_fragment as vehicle_fragment
from companion.identification.residual_analysis import FitQuality as FitQuality
from companion.identification.response import BadFitError as BadFitError
from companion.identification.response import FitNeeds as FitNeeds
from companion.identification.response import RateResponse as RateResponse
from companion.identification.response import fit_rate_response as fit_rate_response
from companion.identification.table import vehicle_table as vehicle_table
from companion.identification.thrust_map import ThrustMap as ThrustMap
from companion.identification.thrust_map import fit_thrust_map as fit_thrust_map
from companion.identification.vehicle import IdentifiedVehicle as IdentifiedVehicle
from companion.identification.vehicle import identify_vehicle as identify_vehicle
