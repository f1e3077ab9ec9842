"""The vehicle as guidance sees it in a replay: the recorded inputs of each guidance step."""

from companion.control.step_rows import StepInput
from companion.vehicle.records import AttitudeTarget, AttitudeTargetThrust, Battery, LocalPosition


class ReplayedVehicle:
    """Telemetry, ground contact and clock of a recorded vehicle, as guidance reads them.

    The attributes are those of `Telemetry`, `Ground` and `Clock` in `companion.control.telemetry`.

    Attributes:
        attitude_target: the newest ATTITUDE_TARGET; None: there was none yet.
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

    def take(self, inputs: StepInput) -> None:
        """Set the attributes to the inputs of the next guidance step.

        A position that was stale in the flight is set to None, so that the replay does not use it.
        """
        self.position = inputs.position if inputs.flags.fresh else None
        self.battery = inputs.battery
        self.attitude_target_thrust = inputs.autopilot_thrust
        self.height, self.armed = inputs.height, inputs.armed
        self.standing, self.may_idle = inputs.flags.standing, inputs.flags.may_idle
        self.offset = inputs.clock_offset

    def age(self, vehicle_time: float, now: float) -> float | None:
        """Always None, unknown: `take` has already left out every position that is stale."""
        return None
