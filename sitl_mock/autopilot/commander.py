"""Arming, modes and what ends them: what every autopilot family's rules of state must answer."""

from typing import Protocol

from pymavlink.dialects.v20 import development as dialect

from sitl_mock.autopilot.state import Mode
from sitl_mock.link.framing import Message
from sitl_mock.physics.quaternion import Vector
from sitl_mock.physics.vehicle import ActuatorCommand

ACCEPTED = int(dialect.MAV_RESULT_ACCEPTED)
TEMPORARILY_REJECTED = int(dialect.MAV_RESULT_TEMPORARILY_REJECTED)
DENIED = int(dialect.MAV_RESULT_DENIED)
UNSUPPORTED = int(dialect.MAV_RESULT_UNSUPPORTED)
FAILED = int(dialect.MAV_RESULT_FAILED)


class Commander(Protocol):
    """Owns ``armed``, ``mode``, ``intended_mode`` and ``failsafe`` of the state."""

    refusal: str | None
    """A reason given from outside why arming is refused (fault injection)."""
    pilot: bool
    """Whether somebody holds the sticks."""

    @property
    def under_setpoints(self) -> bool:
        """Whether the vehicle now flies what setpoints ask."""

    def arm(self, *, force: bool = False) -> int:
        """Arm, and return a MAV_RESULT; ``force`` skips the checks."""

    def announce_problem(self) -> None:
        """Say what forbids arming now, if anything does."""

    def disarm(self, *, force: bool = False) -> int:
        """Disarm, and return a MAV_RESULT; in the air only ``force`` does it."""

    def request_mode(self, mode: Mode) -> int:
        """Change the mode, and return a MAV_RESULT."""

    def take_over(self, mode: Mode) -> None:
        """Let the pilot's sticks change the mode (fault injection)."""

    def heard(self, heartbeat: Message) -> None:
        """Note the heartbeat of another system or component."""

    def setpoint(self, message: Message) -> None:
        """Take a SET_ATTITUDE_TARGET or a SET_POSITION_TARGET_LOCAL_NED."""

    def step(self, *, crashed: bool) -> None:
        """Run the rules once; called at 20 Hz of vehicle time."""


class ModeControl(Protocol):
    """Turns mode, estimate and setpoints into one actuator command a period."""

    def command(self, dt: float) -> ActuatorCommand:
        """Return the command for the next ``dt`` s."""

    def shift(self, yaw_step: float, position_step: Vector) -> None:
        """Move what is held along with an estimator reset (rad, m NED), so the vehicle stays."""
