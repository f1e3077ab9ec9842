"""Whether the vehicle stands on the ground: by more than the autopilot's flag."""

from collections.abc import Callable

from companion.vehicle.state import GROUND_HEIGHT, VehicleState

_STILL = 0.5
"""Vertical speed that may be read on the ground, m/s."""
_LIFTED = 1.0
"""A climb of this much since take-off was commanded leaves the ground, m."""
_SPEED_LASTS = 0.5
"""An older vertical speed says nothing, s."""
_SETTLED = 0.5
"""The flag must say so for this long after a landing, s."""


class GroundContact:
    """Weighs EXTENDED_SYS_STATE against height, vertical speed and what we commanded.

    One wrong "on ground" in flight must not stop the motors, and a vehicle of which flag and
    height disagree is neither treated as standing nor as flying.

    Attributes:
        takeoff_commanded: whether a take-off was commanded in this flight. It stays so: from then
            on no setpoint may be an idle one.

    Args:
        state: what the vehicle tells.
        clock: ours, s.
    """

    def __init__(self, state: VehicleState, clock: Callable[[], float]) -> None:
        self.takeoff_commanded = False
        self._state, self._clock = state, clock
        self._start_height: float | None = None
        self._left = False
        self._landed_since: float | None = None

    def command_takeoff(self) -> None:
        """A take-off is about to be commanded."""
        self.takeoff_commanded = True
        self._start_height = self._state.height

    def look(self) -> None:
        """Remember what the newest telemetry says; called at every look of the watch."""
        state = self._state
        if not state.landed:
            self._landed_since = None
        elif self._landed_since is None:
            self._landed_since = self._clock()
        if self.takeoff_commanded and (state.flying or self._lifted()):
            self._left = True

    @property
    def may_idle(self) -> bool:
        """Whether thrust 0 is right: it stands, by every account, and no take-off was commanded."""
        return self.standing and not self.takeoff_commanded and self._plausible()

    @property
    def standing(self) -> bool:
        """Whether it says that it stands on the ground, and never left it in this flight."""
        rises = self.takeoff_commanded and self._vertical_speed() < -_STILL
        return self._state.landed and not self._left and not rises

    @property
    def touched_down(self) -> bool:
        """Whether it stands again: told for a while, and without vertical speed."""
        since = self._landed_since
        if not self._state.landed or since is None or self._clock() - since < _SETTLED:
            return False
        return abs(self._vertical_speed()) < _STILL

    def _plausible(self) -> bool:
        height = self._state.height
        high = height is not None and abs(height) > GROUND_HEIGHT
        return not high and abs(self._vertical_speed()) < _STILL

    def _lifted(self) -> bool:
        height, start = self._state.height, self._start_height
        return height is not None and start is not None and height - start > _LIFTED

    def _vertical_speed(self) -> float:
        """Downwards, m/s; 0 where it is not told any more."""
        position = self._state.position
        if position is None or self._clock() - position.received > _SPEED_LASTS:
            return 0.0
        return position.velocity_ned[2]
