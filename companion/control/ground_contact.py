"""Tells from landed flag, height, speed and commands whether the vehicle stands on the ground."""

from collections.abc import Callable
from math import inf

from companion.vehicle.state import GROUND_HEIGHT, VehicleState

_STILL_SPEED = 0.5
"""Largest estimated vertical speed of a vehicle on the ground, m/s."""
_IMPACT_SPEED, _IMPACT_TIME = 4.0, 0.25
"""A vehicle that sank faster than `_IMPACT_SPEED`, m/s, and came to rest within `_IMPACT_TIME`, s,
hit the ground: no autopilot brakes its landing so hard."""
_LIFT_OFF_HEIGHT = 1.0
"""Climb since the take-off command, m, above which the vehicle counts as lifted off."""
_MAX_SPEED_AGE = 0.5
"""Largest age of a vertical speed that is used, s."""
_MIN_LANDED_TIME = 0.5
"""Time for which the landed flag must be set before the vehicle counts as landed, s."""


class GroundContact:
    """Compares the landed flag (EXTENDED_SYS_STATE) with height, vertical speed and sent commands.

    A wrong landed flag must not stop the motors in flight. So zero thrust counts as unsafe while
    height or vertical speed contradict the flag.

    Args:
        clock: returns event-loop time, s.

    Attributes:
        takeoff_commanded: whether a take-off was commanded in this flight, or the vehicle already
            flew. If so, no setpoint may have zero thrust.
        has_hit_ground: whether the vehicle hit the ground hard in its landing.
    """

    def __init__(self, state: VehicleState, clock: Callable[[], float]) -> None:
        self.takeoff_commanded = self.has_hit_ground = False
        self._sank_fast_at = -inf
        self._state, self._clock = state, clock
        self._start_height: float | None = None
        self._has_left_ground = False
        self._landed_since: float | None = None

    def command_takeoff(self) -> None:
        """Note that a take-off is about to be commanded."""
        self.takeoff_commanded = True
        self._start_height = self._state.height

    def note_flying(self) -> None:
        """Note that the vehicle already flies, although this program commanded no take-off."""
        self.takeoff_commanded = self._has_left_ground = True

    def update(self) -> None:
        """Use the newest telemetry; to be called at least 50 times a second."""
        state = self._state
        if not state.landed:
            self._landed_since = None
        elif self._landed_since is None:
            self._landed_since = self._clock()
        if self.takeoff_commanded and (state.flying or self._has_climbed()):
            self._has_left_ground = True

    def note_landing(self) -> None:
        """Look for an impact; to be called at least 50 times a second while the vehicle lands."""
        speed, now = self._vertical_speed(), self._clock()
        if speed > _IMPACT_SPEED:
            self._sank_fast_at = now
        elif abs(speed) < _STILL_SPEED and now - self._sank_fast_at < _IMPACT_TIME:
            self.has_hit_ground = True

    @property
    def may_idle(self) -> bool:
        """Whether zero thrust is safe: on the ground by all signs, and no take-off commanded."""
        return self.standing and not self.takeoff_commanded and self._plausibly_on_ground()

    @property
    def resting(self) -> bool:
        """Whether landed flag, height and vertical speed agree that it stands on the ground."""
        position = self._state.position
        is_fresh = position is not None and self._clock() - position.received < _MAX_SPEED_AGE
        return is_fresh and self._state.landed and self._plausibly_on_ground()

    @property
    def standing(self) -> bool:
        """Whether the landed flag is set and the vehicle has not risen since a take-off command."""
        return self._state.landed and not self._has_left_ground and not self._is_rising()

    @property
    def has_lifted_off(self) -> bool:
        """Whether landed flag, height or vertical speed show that the vehicle left the ground."""
        return self._state.flying or self._has_left_ground or self._is_rising()

    @property
    def has_touched_down(self) -> bool:
        """Whether the vehicle has landed: landed flag set for 0.5 s, and small vertical speed."""
        landed_since = self._landed_since
        if (
            not self._state.landed
            or landed_since is None
            or self._clock() - landed_since < _MIN_LANDED_TIME
        ):
            return False
        return abs(self._vertical_speed()) < _STILL_SPEED

    def _plausibly_on_ground(self) -> bool:
        height = self._state.height
        is_high = height is not None and abs(height) > GROUND_HEIGHT
        return not is_high and abs(self._vertical_speed()) < _STILL_SPEED

    def _is_rising(self) -> bool:
        return self.takeoff_commanded and self._vertical_speed() < -_STILL_SPEED

    def _has_climbed(self) -> bool:
        height, start_height = self._state.height, self._start_height
        return (
            height is not None
            and start_height is not None
            and height - start_height > _LIFT_OFF_HEIGHT
        )

    def _vertical_speed(self) -> float:
        """Vertical speed, positive down, m/s; 0 if it is no longer received."""
        position = self._state.position
        if position is None or self._clock() - position.received > _MAX_SPEED_AGE:
            return 0.0
        return position.velocity_ned[2]
