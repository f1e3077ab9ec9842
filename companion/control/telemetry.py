"""Interfaces of what guidance reads: telemetry, ground contact, the vehicle's clock."""

from typing import Protocol

from companion.vehicle.records import AttitudeTargetThrust, Battery, LocalPosition


class Telemetry(Protocol):
    """The telemetry that guidance reads; attributes as in `VehicleState`."""

    @property
    def position(self) -> LocalPosition | None:
        """The newest position."""
        ...

    @property
    def battery(self) -> Battery | None:
        """The newest state of the battery."""
        ...

    @property
    def attitude_target_thrust(self) -> AttitudeTargetThrust | None:
        """The newest thrust in ATTITUDE_TARGET: the autopilot's own, or ours in offboard."""
        ...

    @property
    def height(self) -> float | None:
        """Height above home, m."""
        ...

    @property
    def armed(self) -> bool | None:
        """Whether the vehicle is armed; None: unknown."""
        ...


class Ground(Protocol):
    """Whether the vehicle stands on the ground; implemented by `GroundContact`."""

    @property
    def standing(self) -> bool:
        """Whether the vehicle stands on the ground."""
        ...

    @property
    def may_idle(self) -> bool:
        """Whether zero thrust is safe."""
        ...


class Clock(Protocol):
    """The vehicle's clock; implemented by `VehicleClock`."""

    @property
    def offset(self) -> float | None:
        """Vehicle time minus event-loop time, s; None: not known yet."""
        ...

    def age(self, vehicle_time: float, now: float) -> float | None:
        """Age, at event-loop time `now`, of a message stamped `vehicle_time`, s; None: unknown."""
        ...


class FreshPosition:
    """The newest position while it is fresh.

    Args:
        state: telemetry of the vehicle.
        vehicle_clock: the vehicle's clock.
        max_age: largest age of a position that is used, s.
    """

    def __init__(self, state: Telemetry, vehicle_clock: Clock, max_age: float) -> None:
        self._state, self._vehicle_clock, self._max_age = state, vehicle_clock, max_age

    def at(self, now: float) -> LocalPosition | None:
        """The newest position; None if its arrival or measurement is too old at `now`, s."""
        position = self._state.position
        if position is None or now - position.received > self._max_age:
            return None
        age = self._vehicle_clock.age(position.vehicle_time, now)
        return None if age is not None and age > self._max_age else position
