"""The interfaces of arming and modes (`Commander`) and of the control in a mode (`ModeControl`)."""

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
    """Sets ``armed``, ``mode``, ``intended_mode`` and ``failsafe`` of the state."""

    arming_refusal: str | None
    """Reason of an active `RefuseArming` fault, None without one."""
    pilot_simulated: bool
    """Whether a fault simulates a pilot at the sticks."""

    @property
    def obeys_setpoints(self) -> bool:
        """Whether setpoints control the vehicle now."""

    def arm(self, *, force: bool = False) -> int:
        """Arm, and return a MAV_RESULT; ``force`` skips most checks, but never the crash check."""

    def announce_problem(self) -> None:
        """Announce what forbids arming now, if anything does."""

    def disarm(self, *, force: bool = False) -> int:
        """Disarm, and return a MAV_RESULT; in the air this needs ``force``."""

    def request_mode(self, mode: Mode) -> int:
        """Change the mode, and return a MAV_RESULT."""

    def take_over(self, mode: Mode) -> None:
        """Enter a mode as a pilot who takes over would (fault injection)."""

    def receive_heartbeat(self, heartbeat: Message) -> None:
        """Record a heartbeat of another system or component, to notice the loss of its sender."""

    def receive_setpoint(self, message: Message) -> None:
        """Handle a SET_ATTITUDE_TARGET or a SET_POSITION_TARGET_LOCAL_NED."""

    def step(self, *, crashed: bool) -> None:
        """Update arming, mode and failsafes; called at 20 Hz of vehicle time."""


class ModeControl(Protocol):
    """Computes the actuator command of each period from mode, estimate and setpoints."""

    def command(self, dt: float) -> ActuatorCommand:
        """Return the actuator command for the next ``dt`` s."""

    def shift(self, yaw_step: float, position_step: Vector) -> None:
        """Move the held heading (rad) and position (m, NED) by the jumps of an estimator reset."""
