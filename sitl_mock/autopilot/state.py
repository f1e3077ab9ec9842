"""The autopilot's state: one mutable record of latest values, which all its parts share."""

from dataclasses import dataclass, field
from enum import Enum, IntEnum, auto
from math import nan

from sitl_mock.physics.quaternion import Quaternion, Vector
from sitl_mock.physics.vehicle import DISARMED_COMMAND, ActuatorCommand, Estimate

NAN_VECTOR = (nan, nan, nan)


class Mode(Enum):
    """A flight mode: PX4's names down to OFFBOARD, then those that only ArduCopter has."""

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


class Landed(IntEnum):
    """MAV_LANDED_STATE."""

    ON_GROUND = 1
    IN_AIR = 2
    TAKEOFF = 3
    LANDING = 4


class BatteryWarning(IntEnum):
    """Battery warning; the numbers are MAV_BATTERY_CHARGE_STATE."""

    OK = 1
    LOW = 2
    CRITICAL = 3
    EMERGENCY = 4


@dataclass
class AttitudeTarget:
    """Setpoint of the attitude and rate controllers, for ATTITUDE_TARGET. rad/s, thrust 0..1."""

    q: Quaternion = (1.0, 0.0, 0.0, 0.0)
    rates: Vector = (0.0, 0.0, 0.0)
    thrust: float = 0.0


@dataclass
class PositionTarget:
    """Setpoint of the position controller, for POSITION_TARGET_LOCAL_NED. NED, SI, yaw in rad."""

    active: bool = False
    position: Vector = NAN_VECTOR
    velocity: Vector = NAN_VECTOR
    acceleration: Vector = NAN_VECTOR
    yaw: float = nan


@dataclass
class State:
    """The autopilot's present state; times are vehicle time since boot."""

    estimate: Estimate
    time_us: int = 0
    stamp_us: int = 0
    """Time stamp of telemetry, us; not equal to ``time_us`` while a fault freezes the clock."""
    armed: bool = False
    armed_at_us: int = 0
    mode: Mode = Mode.LOITER
    intended_mode: Mode = Mode.LOITER
    mode_after_disarming: Mode = Mode.LOITER
    """The mode that PX4 enters when it disarms."""
    status_published_us: int = 0
    """Vehicle time at which PX4 last published its status (mode and arming), us."""
    failsafe: bool = False
    prearm_problem: str | None = "system is booting"
    """Reason for which arming is refused, None if it is allowed."""
    ground_contact: bool = True
    """Whether the vehicle touches the ground."""
    landed: bool = True
    """Whether the land detector reports landed."""
    landed_state: Landed = Landed.ON_GROUND
    took_off: bool = False
    """Whether the vehicle has left the ground since arming."""
    position_valid: bool = True
    gps_ok: bool = True
    battery_remaining: float = 1.0
    battery_warning: BatteryWarning = BatteryWarning.OK
    home_ned: Vector = (0.0, 0.0, 0.0)
    home_q: Quaternion = (1.0, 0.0, 0.0, 0.0)
    home_set_at_us: int = 0
    command: ActuatorCommand = DISARMED_COMMAND
    attitude_target: AttitudeTarget = field(default_factory=AttitudeTarget)
    position_target: PositionTarget = field(default_factory=PositionTarget)
    height_controlled: bool = False
    """Whether ArduPilot's height controller runs."""
    position_controlled: bool = False
    """Whether ArduPilot's horizontal position controller runs."""
    aborted: bool = False
    """Whether ArduPilot's process has ended; it then sends nothing more."""

    @property
    def time_s(self) -> float:
        """Vehicle time in s since boot."""
        return self.time_us / 1e6
