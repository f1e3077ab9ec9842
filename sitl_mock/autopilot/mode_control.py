"""What each flight mode asks of the rate loop: what every autopilot family's modes must answer."""

from typing import Protocol

from sitl_mock.physics.quaternion import Vector
from sitl_mock.physics.vehicle import ActuatorCommand


class ModeControl(Protocol):
    """Turns mode, estimate and setpoints into one actuator command a period."""

    def command(self, dt: float) -> ActuatorCommand:
        """Return the command for the next ``dt`` s."""

    def shift(self, yaw_step: float, position_step: Vector) -> None:
        """Move what is held along with an estimator reset (rad, m NED), so the vehicle stays."""
