"""Judges every setpoint that reaches a mock vehicle: within limits, and for a live client."""

import math

from companion.config.files import load
from tests.serve.virtual import CONFIGS

TIMEOUT, HOLD = 0.5, 1.0
HAND_BACK = 1.0
"""Until the autopilot has shown that it holds, the vehicle is steered, s."""
AT_ONCE = 0.3
"""Until a mode that somebody commanded shows, s; CURRENT_MODE comes at 20 Hz."""
_ROUNDING = 1e-3


class SetpointJudge:
    """Looks at the setpoints after each step of the vehicle.

    The tests tell it who commands, so it does not ask the code under test.

    Attributes:
        until: vehicle time until which a setpoint may come, s.
        count: setpoints judged.
    """

    def __init__(self, vehicle, autopilot):
        self._vehicle = vehicle
        self._limits = load(CONFIGS / f"mock-{autopilot}.yaml").limits
        self.until = -math.inf
        self.count = 0
        vehicle.after_step.append(self._look)

    def commanded(self):
        """A client that is in control, or asks for it, sent a setpoint that is to be flown."""
        self.until = self._vehicle.time + TIMEOUT + HOLD + HAND_BACK

    def ended(self):
        """Somebody has taken control away."""
        self.until = min(self.until, self._vehicle.time + AT_ONCE)

    def _look(self):
        for setpoint in self._vehicle.setpoints:
            self._judge(setpoint)
        self.count += len(self._vehicle.setpoints)
        self._vehicle.setpoints.clear()

    def _judge(self, setpoint):
        limits, (roll, pitch, yaw) = self._limits, setpoint.rates
        assert math.hypot(roll, pitch) <= limits.max_tilt_rate + _ROUNDING, setpoint
        assert abs(yaw) <= limits.max_yaw_rate + _ROUNDING, setpoint
        low, high = limits.min_thrust - _ROUNDING, limits.max_thrust + _ROUNDING
        assert low <= setpoint.thrust <= high, setpoint
        assert setpoint.time <= self.until, f"nobody commands: {setpoint}"
