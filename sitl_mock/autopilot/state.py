"""What the autopilot's parts tell one another: one mutable record, as a bus of latest values."""

from dataclasses import dataclass, field
from enum import Enum, IntEnum, auto

from sitl_mock.physics.quaternion import Quaternion, Vector
from sitl_mock.physics.vehicle import ActuatorCommand, Estimate


class Mode(Enum):
    """A flight mode, as its autopilot calls it: PX4's down to OFFBOARD, then ArduCopter's own."""

    MANUAL = auto()
    ALTCTL = auto()
    POSCTL = auto()
    STABILIZED = auto()
    LOITER = auto()
    TAKEOFF = auto()
    RTL = auto()
    LAND = auto()
    OFFBOARD = auto()
    STABILIZE = auto()
    ALT_HOLD = auto()
    GUIDED = auto()
    BRAKE = auto()


NAN = float("nan")
NAN_VECTOR = (NAN, NAN, NAN)


class Landed(IntEnum):
    """MAV_LANDED_STATE."""

    ON_GROUND = 1
    IN_AIR = 2
    TAKEOFF = 3
    LANDING = 4


class BatteryWarning(IntEnum):
    """How empty the battery is; the numbers are MAV_BATTERY_CHARGE_STATE."""

    OK = 1
    LOW = 2
    CRITICAL = 3
    EMERGENCY = 4


@dataclass
class AttitudeTargetEcho:
    """What the attitude and rate controllers follow, for ATTITUDE_TARGET. rad/s, thrust 0..1."""

    q: Quaternion = (1.0, 0.0, 0.0, 0.0)
    rates: Vector = (0.0, 0.0, 0.0)
    thrust: float = 0.0


@dataclass
class PositionTargetEcho:
    """What the position controller follows, for POSITION_TARGET_LOCAL_NED. NED, SI, yaw in rad."""

    active: bool = False
    position: Vector = NAN_VECTOR
    velocity: Vector = NAN_VECTOR
    acceleration: Vector = NAN_VECTOR
    yaw: float = NAN


@dataclass
class State:
    """The autopilot's present state.

    Times are vehicle time in us since boot. ``shown_us`` is what telemetry carries as the time; it
    differs from ``time_us`` only while a fault freezes the clock. ``contact`` is touching the
    ground, ``landed`` what the land detector makes of it; ``flown``: took off since arming.
    ``status_us``: when the status was last published, which tells of mode and arming.
    ``after_disarming``: the mode that PX4 goes to when it disarms.
    ``height_controlled`` and ``position_controlled``: ArduPilot's controllers run. ``aborted``: its
    process has ended, and nothing comes any more.
    """

    estimate: Estimate
    time_us: int = 0
    shown_us: int = 0
    armed: bool = False
    armed_at_us: int = 0
    mode: Mode = Mode.LOITER
    intended_mode: Mode = Mode.LOITER
    after_disarming: Mode = Mode.LOITER
    status_us: int = 0
    failsafe: bool = False
    prearm_problem: str | None = "system is booting"
    contact: bool = True
    landed: bool = True
    landed_state: Landed = Landed.ON_GROUND
    flown: bool = False
    position_valid: bool = True
    gps_ok: bool = True
    battery_remaining: float = 1.0
    battery_warning: BatteryWarning = BatteryWarning.OK
    home_ned: Vector = (0.0, 0.0, 0.0)
    home_q: Quaternion = (1.0, 0.0, 0.0, 0.0)
    home_set_at_us: int = 0
    command: ActuatorCommand = field(
        default_factory=lambda: ActuatorCommand(False, 0.0, 0.0, 0.0, 0.0)
    )
    attitude_target: AttitudeTargetEcho = field(default_factory=AttitudeTargetEcho)
    height_controlled: bool = False
    position_controlled: bool = False
    aborted: bool = False
    position_target: PositionTargetEcho = field(default_factory=PositionTargetEcho)

    @property
    def time_s(self) -> float:
        """Vehicle time in s since boot."""
        return self.time_us / 1e6
