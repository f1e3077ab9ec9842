"""Identifies a whole vehicle, three axes and thrust, from the rows of one flight."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from companion.identification.response import RateResponse, fit_rate_response
from companion.identification.thrust_map import ThrustMap, fit_thrust_map
from companion.least_squares import Floats

_ASSUMED_GAIN = 1.0
"""Gain of the rate loop that the planners assume."""
AXES = ("roll", "pitch", "yaw")


@dataclass(frozen=True, slots=True)
class IdentifiedVehicle:
    """The fitted response of a vehicle; each fit says whether it may be used."""

    roll: RateResponse
    pitch: RateResponse
    yaw: RateResponse
    thrust: ThrustMap | None
    """The thrust map; None if thrust never changed or was hardly measured."""

    @property
    def axes(self) -> dict[str, RateResponse]:
        """The responses by name of the axis: roll, pitch, yaw."""
        return dict(zip(AXES, (self.roll, self.pitch, self.yaw), strict=True))

    def flaws(self) -> dict[str, str]:
        """Name of each axis whose fit must not be used, and the reason; empty if all are good."""
        flaws = {name: response.flaw() for name, response in self.axes.items()}
        return {name: flaw for name, flaw in flaws.items() if flaw is not None}


def identify_vehicle(
    setpoints: ArrayLike, rates: ArrayLike, specific_thrust: ArrayLike
) -> IdentifiedVehicle:
    """Fit each axis and the thrust map.

    Lag and dead time are fitted for a first-order rate loop of gain 1, as the planners assume. If
    the real loop has another order or gain, lag and dead time are the best approximation.

    Args:
        setpoints: (n, 5), setpoints that controlled the vehicle: vehicle time of the sample to
            which each responds, s; roll, pitch and yaw rate, rad/s; normalised thrust.
        rates: (m, 4), vehicle time in s, measured roll, pitch and yaw rate in rad/s.
        specific_thrust: (k, 2), vehicle time in s, m/s²; may be empty.

    Raises:
        ValueError: rows have another number of columns.
    """
    commands, measured = _rows("setpoints", setpoints, 5), _rows("rates", rates, 4)
    accelerations = _rows("specific_thrust", specific_thrust, 2)
    roll, pitch, yaw = (
        fit_rate_response(
            commands[:, 0], commands[:, axis], measured[:, 0], measured[:, axis], _ASSUMED_GAIN
        )
        for axis in (1, 2, 3)
    )
    thrust = fit_thrust_map(
        commands[:, 0], commands[:, 4], accelerations[:, 0], accelerations[:, 1]
    )
    return IdentifiedVehicle(roll, pitch, yaw, thrust)


def _rows(name: str, values: ArrayLike, columns: int) -> Floats:
    """`values` as an array (n, columns); n is 0 for an empty list. Messages call it `name`.

    Raises:
        ValueError: the array has another shape.
    """
    array = np.asarray(values, dtype=np.float64)
    if array.size == 0:
        return np.empty((0, columns))
    if array.ndim != 2 or array.shape[1] != columns:
        raise ValueError(f"{name} must have the shape (n, {columns}), not {array.shape}")
    return array
