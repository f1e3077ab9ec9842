"""ArduCopter's RTL: climb, fly home, wait above home, land."""

from enum import Enum, auto
from math import hypot

from sitl_mock.autopilot.parameters import ParameterTable
from sitl_mock.autopilot.state import State

_HOME_RADIUS_M = 2.0
"""Distance at which the vehicle has reached home (WPNAV_RADIUS)."""
_CLIMB_TOLERANCE_M = 0.3
"""Distance below the height of the flight home at which the climb ends, m."""


class Leg(Enum):
    """Legs of the return."""

    CLIMB = auto()
    HOME = auto()
    WAIT = auto()
    LAND = auto()


class ReturnHome:
    """The height and the leg of a return."""

    def __init__(self, state: State, parameters: ParameterTable) -> None:
        self._state = state
        self._parameters = parameters
        self.leg = Leg.CLIMB
        self.height = 0.0
        """Height of the flight home, m above the local origin."""
        self._waiting_since_us = 0

    def begin(self) -> None:
        """Choose the height of the flight home: RTL_ALT, or a lower one near home (RTL_CONE_SLOPE).

        The vehicle never descends to this height: it keeps a higher present height.
        """
        state, parameters = self._state, self._parameters
        present_height = -state.estimate.position_ned[2]
        cone_height = parameters["RTL_CONE_SLOPE"] * self._distance()
        return_height = min(0.01 * parameters["RTL_ALT"], cone_height) - state.home_ned[2]
        self.height = max(present_height, return_height)
        self.leg = Leg.CLIMB

    def step(self) -> None:
        """Start the next leg when the present one is complete."""
        state = self._state
        if self.leg is Leg.CLIMB:
            if self.height + state.estimate.position_ned[2] < _CLIMB_TOLERANCE_M:
                self.leg = Leg.HOME
        elif self.leg is Leg.HOME:
            if self._distance() < _HOME_RADIUS_M:
                self.leg = Leg.WAIT
                self._waiting_since_us = state.time_us
        elif self.leg is Leg.WAIT:
            waited_ms = (state.time_us - self._waiting_since_us) / 1e3
            if waited_ms >= self._parameters["RTL_LOIT_TIME"]:
                self.leg = Leg.LAND

    def _distance(self) -> float:
        (x, y, _), home = self._state.estimate.position_ned, self._state.home_ned
        return hypot(x - home[0], y - home[1])
