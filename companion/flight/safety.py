"""What is watched while the autopilot obeys us, and what each breach leads to."""

from collections.abc import Callable
from dataclasses import dataclass
from math import hypot

from companion.flight.ending import Exit, FlightEnded
from companion.guidance import Pose
from companion.mavlink.state import VehicleState

_GPS_FIX_3D = 3
_STATUS_STALE = 5.0
"""The battery is reported at 1 Hz at least; silence this long, in s, hides an empty one."""


@dataclass(frozen=True, slots=True)
class Fence:
    """A cylinder about the pose where control began, with a floor above home; all in m."""

    radius: float
    ceiling: float
    floor: float


class SafetyMonitors:
    """Judges the vehicle's state; every breach ends the flight with a reason.

    Args:
        state: the vehicle as the link knows it.
        fence: where it may fly.
        min_battery: remaining share, 0..1.
        clock: our clock, s.
    """

    def __init__(
        self, state: VehicleState, fence: Fence, min_battery: float, clock: Callable[[], float]
    ) -> None:
        self._clock = clock
        self._state = state
        self._fence = fence
        self._min_battery = min_battery
        self._reset_counter: int | None = None
        self._had_gps = False

    def begin(self) -> None:
        """Control begins: resets of the estimator before this do not count."""
        self._reset_counter = self._state.reset_counter
        gps = self._state.gps
        self._had_gps = gps is not None and gps.fix_type >= _GPS_FIX_3D

    def check(self, pose: Pose | None) -> None:
        """Judge once.

        Raises:
            FlightEnded: the first breach found, with what is to be done.
        """
        state = self._state
        if not state.armed:
            raise FlightEnded("the vehicle disarmed in flight", Exit.LET_GO)
        if state.landed:
            raise FlightEnded("the autopilot says that it has landed", Exit.LAND)
        if state.failsafe:
            raise FlightEnded("the autopilot reports a failsafe", Exit.LET_GO)
        if state.battery is not None and self._clock() - state.battery.received > _STATUS_STALE:
            raise FlightEnded("the battery's state is not reported any more", Exit.LAND)
        battery = state.battery_remaining
        if battery is not None and battery < self._min_battery:
            raise FlightEnded(
                f"battery at {100 * battery:.0f} %, below "
                f"limits.min_battery_percent {100 * self._min_battery:.0f}",
                Exit.LAND,
            )
        if self._had_gps and state.gps is not None and state.gps.fix_type < _GPS_FIX_3D:
            raise FlightEnded("GPS position lost", Exit.LAND)
        if self._reset_counter is None:
            self._reset_counter = state.reset_counter
        if state.reset_counter != self._reset_counter:
            raise FlightEnded("the autopilot's estimator was reset", Exit.LAND)
        if pose is not None:
            self._check_fence(pose)

    def _check_fence(self, pose: Pose) -> None:
        position = self._state.position
        if position is None:
            return
        north, east, down = position.position_ned
        distance = hypot(north - pose.position_ned[0], east - pose.position_ned[1])
        if distance > self._fence.radius:
            raise FlightEnded(
                f"{distance:.1f} m from where control began, beyond limits.fence_radius_m",
                Exit.LAND,
            )
        if pose.position_ned[2] - down > self._fence.ceiling:
            raise FlightEnded("above limits.fence_ceiling_m", Exit.LAND)
        height = self._state.height
        if height is not None and height < self._fence.floor:
            raise FlightEnded(f"{height:.1f} m above home, below limits.fence_floor_m", Exit.LAND)
