"""The transport delay of a body-rate setpoint, each axis its own."""

from collections import deque

from sitl_mock.physics.quaternion import Vector


class SetpointDelay:
    """Holds setpoints back, to the nearest whole step; before the first they were zero.

    Args:
        delays_ms: of roll, pitch and yaw.
        dt: step, s.
    """

    __slots__ = ("_pitch", "_roll", "_yaw")

    def __init__(self, delays_ms: Vector, dt: float) -> None:
        self._roll, self._pitch, self._yaw = (
            deque([0.0] * steps, maxlen=steps)
            for steps in (1 + round(delay_ms * 1e-3 / dt) for delay_ms in delays_ms)
        )

    def step(self, setpoint: Vector) -> Vector:
        """Take this step's setpoint; return the one that arrives."""
        roll, pitch, yaw = self._roll, self._pitch, self._yaw
        roll.append(setpoint[0])
        pitch.append(setpoint[1])
        yaw.append(setpoint[2])
        return roll[0], pitch[0], yaw[0]
