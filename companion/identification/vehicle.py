"""A whole vehicle identified from the rows of one flight."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from companion.identification.response import RateResponse, fit_rate_response
from companion.identification.thrust_map import ThrustMap, fit_thrust_map

Rows = Sequence[Sequence[float]]
Floats = NDArray[np.float64]

_PLANNERS_GAIN = 1.0

AXES = ("roll", "pitch", "yaw")


@dataclass(frozen=True, slots=True)
class IdentifiedVehicle:
    """How a vehicle answers body rates and thrust; each fit tells whether it may be used.

    Attributes:
        roll: as fitted.
        pitch: as fitted.
        yaw: as fitted.
        thrust: the map, or None where thrust never changed or was not measured.
    """

    roll: RateResponse
    pitch: RateResponse
    yaw: RateResponse
    thrust: ThrustMap | None

    @property
    def axes(self) -> dict[str, RateResponse]:
        """The responses by the axis's name."""
        return dict(zip(AXES, (self.roll, self.pitch, self.yaw), strict=True))

    def faults(self) -> dict[str, str]:
        """Why which axis must not be used; empty if all of them may be."""
        reasons = {name: response.reason() for name, response in self.axes.items()}
        return {name: reason for name, reason in reasons.items() if reason is not None}


def identify_vehicle(setpoints: Rows, rates: Rows, specific_thrust: Rows) -> IdentifiedVehicle:
    """Fit each axis and the thrust map.

    Lag and dead time are those of a rate loop of gain 1, since that is what a planner takes it for;
    where the loop is of another order or falls short, they are the ones that come nearest to it.

    Args:
        setpoints: (n, 5), vehicle time of the sample answered in s, roll, pitch and yaw rate in
            rad/s, normalised thrust; those that the vehicle obeyed.
        rates: (m, 4), vehicle time in s, measured roll, pitch and yaw rate in rad/s.
        specific_thrust: (k, 2), vehicle time in s, m/s²; may be empty.
    """
    asked, measured, pushed = _table(setpoints, 5), _table(rates, 4), _table(specific_thrust, 2)
    roll, pitch, yaw = (_response(asked, measured, axis) for axis in (1, 2, 3))
    thrust = fit_thrust_map(asked[:, 0], asked[:, 4], pushed[:, 0], pushed[:, 1])
    return IdentifiedVehicle(roll, pitch, yaw, thrust)


def _table(rows: Rows, columns: int) -> Floats:
    return np.array(rows, dtype=np.float64).reshape(-1, columns)


def _response(asked: Floats, measured: Floats, axis: int) -> RateResponse:
    record = asked[:, 0], asked[:, axis], measured[:, 0], measured[:, axis]
    return fit_rate_response(*record, gain=_PLANNERS_GAIN)
