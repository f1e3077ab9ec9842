"""Records the true motion of a mock vehicle."""

import numpy as np
from numpy.typing import NDArray

from companion.attitude.kinematics import tilt_angle
from companion.testing.vehicle import MockVehicle

Floats = NDArray[np.float64]

_STEPS_PER_ROW = 5
"""Steps of the vehicle from one recorded row to the next."""


class TruthRecorder:
    """Records the true motion of a vehicle; `MockVehicle.after_step` calls it."""

    def __init__(self, vehicle: MockVehicle) -> None:
        self._vehicle, self._steps = vehicle, 0
        self._rows: list[tuple[float, ...]] = []
        vehicle.after_step.append(self._record)

    def rows(self) -> Floats:
        """(N, 5): vehicle time (s), position north, east and down of home (m), tilt (rad)."""
        return np.array(self._rows).reshape(-1, 5)

    def _record(self) -> None:
        self._steps += 1
        if self._steps % _STEPS_PER_ROW == 0:
            state = self._vehicle.state()
            _, x, y, _ = state["q"]
            self._rows.append((self._vehicle.time, *state["position"], tilt_angle(x, y)))


def true_positions(truth: Floats, times: Floats) -> Floats:
    """(n, 3): true position at (n,) vehicle times (s), m, NED; `truth`: `TruthRecorder.rows`."""
    return np.column_stack([np.interp(times, truth[:, 0], axis) for axis in truth[:, 1:4].T])
