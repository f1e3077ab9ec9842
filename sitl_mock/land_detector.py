"""Landed or not, by PX4's rules: contact and little thrust for a while; taken off at once."""

from sitl_mock.modes import Mode
from sitl_mock.state import Landed, State

LANDED_AFTER_US = 1_100_000
"""Contact with little thrust for this long is a landing (measured 1.1 s)."""
LOW_THRUST_SHARE = 0.3
"""Little thrust: below this share of the hover thrust."""


class LandDetector:
    """Keeps ``contact``, ``landed`` and ``flown`` of the state.

    Args:
        state: the autopilot's state.
    """

    def __init__(self, state: State) -> None:
        self._state = state
        self._quiet_since_us = 0

    def step(self, *, contact: bool, hover_thrust: float) -> None:
        """Look once: ``contact`` with the ground, and the thrust commanded."""
        state = self._state
        state.contact = contact
        # Written so that a NaN thrust, which is none, counts as little.
        pushing = state.armed and state.command.thrust > LOW_THRUST_SHARE * hover_thrust
        if not contact or pushing:
            self._quiet_since_us = state.time_us
            state.landed = False
            state.flown = state.flown or not contact
        elif not state.armed or state.time_us - self._quiet_since_us >= LANDED_AFTER_US:
            state.landed = True

    def landed_state(self, *, climbing: bool) -> Landed:
        """Return EXTENDED_SYS_STATE.landed_state; ``climbing``: TAKEOFF is still below its end."""
        state = self._state
        if state.landed:
            return Landed.ON_GROUND
        if state.mode is Mode.TAKEOFF and climbing:
            return Landed.TAKEOFF
        if state.mode is Mode.LAND:
            return Landed.LANDING
        return Landed.IN_AIR
