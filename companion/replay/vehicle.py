"""The vehicle of a replay: the recorded inputs of guidance, step by step."""

from companion.control.step_rows import StepInput
from companion.vehicle.records import (
    AttitudeTarget,
    AttitudeTargetThrust,
    Battery,
    LocalPosition,
)


class ReplayedVehicle:
    """Telemetry, ground contact and clock of a recorded vehicle, as guidance reads them.

    The attributes are those of `Telemetry`, `Ground` and `Clock` in `companion.control.telemetry`.

    Attributes:
        attitude_target: the newest ATTITUDE_TARGET, or None.
    """

    def __init__(self) -> None:
        self.position: LocalPosition | None = None
        self.battery: Battery | None = None
        self.attitude_target_thrust: AttitudeTargetThrust | None = None
        self.attitude_target: AttitudeTarget | None = None
        self.height: float | None = None
        self.armed: bool | None = None
        self.standing = self.may_idle = False
        self.offset: float | None = None

    def take(self, read: StepInput) -> None:
        """Take the inputs of the next guidance step.

        A position that was stale in the flight is left out, so that it is stale in the replay.
        """
        self.position = read.position if read.flags.fresh else None
        self.battery = read.battery
        self.attitude_target_thrust = read.autopilot_thrust
        self.height, self.armed = read.height, read.armed
        self.standing, self.may_idle = read.flags.standing, read.flags.may_idle
        self.offset = read.clock_offset

    def age(self, vehicle_time: float, now: float) -> float | None:
        """Always None (unknown): `take` leaves out every position that is not fresh."""
        return None
