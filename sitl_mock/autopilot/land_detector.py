"""Land detector: a landing is contact with low thrust for some time, or contact while disarmed.

Without contact, or with more thrust, the vehicle counts as taken off at once.
"""

from collections.abc import Callable

from sitl_mock.autopilot.events import Announce, EventKind
from sitl_mock.autopilot.state import Landed, Mode, State

LOW_THRUST_FRACTION = 0.3
"""Share of the hover thrust below which the thrust counts as low."""


class LandDetector:
    """Updates ``ground_contact``, ``landed``, ``landed_state`` and ``took_off`` of the state.

    Args:
        hover_thrust: returns the thrust command that hovers, 0..1.
        landed_after_us: contact with low thrust for this time is a landing.
        is_taking_off: returns whether a take-off has begun and has not reached its height.
    """

    def __init__(
        self,
        state: State,
        announce: Announce,
        *,
        hover_thrust: Callable[[], float],
        landed_after_us: int,
        is_taking_off: Callable[[], bool],
    ) -> None:
        self._state = state
        self._announce = announce
        self._hover_thrust = hover_thrust
        self._landed_after_us = landed_after_us
        self._is_taking_off = is_taking_off
        self._resting_since_us = 0

    def step(self, *, ground_contact: bool) -> None:
        """Update the state from ground contact and the commanded thrust."""
        state = self._state
        was_landed = state.landed
        self._update(ground_contact=ground_contact)
        if was_landed != state.landed and state.armed:
            kind = EventKind.LANDING_DETECTED if state.landed else EventKind.TAKEOFF_DETECTED
            self._announce(kind, "")
        state.landed_state = self._landed_state()

    def _update(self, *, ground_contact: bool) -> None:
        state = self._state
        state.ground_contact = ground_contact
        if not ground_contact or self._thrust_is_high():
            self._resting_since_us = state.time_us
            state.landed = False
            state.took_off = state.took_off or not ground_contact
        elif not state.armed or state.time_us - self._resting_since_us >= self._landed_after_us:
            state.landed = True

    def _thrust_is_high(self) -> bool:
        state = self._state
        # A NaN thrust, which means none, fails this comparison and counts as low.
        return state.armed and state.command.thrust > LOW_THRUST_FRACTION * self._hover_thrust()

    def _landed_state(self) -> Landed:
        """Return EXTENDED_SYS_STATE.landed_state."""
        state = self._state
        if state.landed:
            return Landed.ON_GROUND
        if self._is_taking_off():
            return Landed.TAKEOFF
        if state.mode is Mode.LAND:
            return Landed.LANDING
        return Landed.IN_AIR
