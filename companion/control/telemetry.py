"""Interfaces of what guidance reads: telemetry, ground contact, the vehicle's clock."""

from typing import NamedTuple, Protocol

from companion.vehicle.records import AttitudeTargetThrust, Battery, LocalPosition


class Telemetry(Protocol):
    """The telemetry that guidance reads; attributes as in `VehicleState`."""

    @property
    def position(self) -> LocalPosition | None:
        """The newest position."""

    @property
    def battery(self) -> Battery | None:
        """The newest state of the battery."""

    @property
    def attitude_target_thrust(self) -> AttitudeTargetThrust | None:
        """The newest thrust in ATTITUDE_TARGET: the autopilot's own, or ours in offboard."""

    @property
    def height(self) -> float | None:
        """Height above home, m."""

    @property
    def armed(self) -> bool | None:
        """Whether the vehicle is armed; None: unknown."""


class Ground(Protocol):
    """Whether the vehicle stands on the ground; implemented by `GroundContact`."""

    @property
    def standing(self) -> bool:
        """Whether the vehicle stands on the ground."""

    @property
    def may_idle(self) -> bool:
        """Whether zero thrust is safe."""


class Clock(Protocol):
    """The vehicle's clock; implemented by `VehicleClock`."""

    @property
    def offset(self) -> float | None:
        """Vehicle time minus event-loop time, s; None: not known yet."""

    def age(self, vehicle_time: float, now: float) -> float | None:
        """Age, at event-loop time `now`, of a message stamped `vehicle_time`, s; None: unknown."""


class GuidedVehicle(NamedTuple):
    """The vehicle as guidance reads it."""

    state: Telemetry
    ground: Ground
    """Tells whether the vehicle stands on the ground."""
    clock: Clock

    def fresh_position(self, now: float, max_age: float) -> LocalPosition | None:
        """The newest position; None if its arrival or measurement is over `max_age` s before `now`.

        `now` is event-loop time, s.
        """
        position = self.state.position
        if position is None or now - position.received > max_age:
            return None
        age = self.clock.age(position.vehicle_time, now)
        return None if age is not None and age > max_age else position
