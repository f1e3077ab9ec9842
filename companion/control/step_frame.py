"""The frame of open-loop steps, in which the estimator's heading corrections are left out.

A step should be a straight line in the world. An estimator corrects its heading most when the
vehicle accelerates after a hover: by 1.3° within the first step on ArduCopter's simulator, which
bends that line by 0.015. The body rates show that the vehicle did not turn. So while steps are
flown, the planner sees an attitude without the heading changes that body rates do not explain.

In closed loop, guidance computes each acceleration in the estimator's frame. The horizontal target
is rotated together with the attitude, so the acceleration stays as guidance commands it. The turn
of this frame decays. The heading target is not rotated, because it would jump where steps begin and
end.

ArduPilot takes body rates along an attitude target that stays in the estimator's frame, so the
vehicle follows each correction: it turns about the vertical, and when tilted its thrust axis turns,
too. The rates of such an autopilot get the rotation of this frame added.
"""

from math import exp, radians

from companion.attitude import BodyRates, Quaternion, Target
from companion.attitude.reference import first_order_step
from companion.attitude.rotation import clamp, down_in_body, turned_about_vertical
from companion.guidance.reference import rotated

_LARGEST_TURN = radians(3.0)
"""Largest turn of the frame, rad. It limits the effect of a wrong gyro."""
_DECAY_S = 2.0
"""Time constant with which the turn decays after the steps, s."""
_FOLLOWING_S = 1.0 / 4.5
"""Time constant with which ArduPilot's attitude controller follows its target (ATC_ANG_*_P), s."""


class StepFrame:
    """Converts between the estimator's frame and the frame in which open-loop steps are straight.

    Attributes:
        turn: heading in the estimator's frame minus heading in the frame of steps, rad.
        turn_rate: rate of `turn`, low-passed, rad/s.
    """

    def __init__(self) -> None:
        self.turn = self.turn_rate = 0.0
        self._corrections_at_zero = 0.0  # `corrections` at which the turn is 0

    def advance(self, corrections: float, dt: float, *, stepping: bool) -> None:
        """Follow the estimator's corrections during steps; let the turn decay otherwise.

        Args:
            corrections: sum of all heading changes that body rates do not explain, rad.
            dt: time since the last call, s.
            stepping: whether an open-loop step is flown.
        """
        before = self.turn
        if stepping:
            self.turn = clamp(corrections - self._corrections_at_zero, _LARGEST_TURN)
        else:
            self.turn *= exp(-dt / _DECAY_S)
            self._corrections_at_zero = corrections - self.turn
        if dt > 0.0:
            turning = (self.turn - before) / dt
            _, self.turn_rate = first_order_step(self.turn_rate, turning, _FOLLOWING_S, dt)

    def attitude(self, q: Quaternion) -> Quaternion:
        """An attitude of the estimator's frame in this frame."""
        return q if self.turn == 0.0 else turned_about_vertical(q, -self.turn)

    def rates(self, q: Quaternion, rates: BodyRates) -> BodyRates:
        """Body rates in the estimator's frame, from body rates in this frame at attitude `q`."""
        turn_rate = self.turn_rate
        if turn_rate == 0.0:
            return rates
        x, y, z = down_in_body(q)
        return BodyRates(
            rates.roll + x * turn_rate, rates.pitch + y * turn_rate, rates.yaw + z * turn_rate
        )

    def target(self, target: Target) -> Target:
        """A target of the estimator's frame, its horizontal part converted to this frame.

        The heading stays. Targets of open-loop steps are in this frame already.
        """
        if self.turn == 0.0:
            return target
        north, east = rotated(target.north, target.east, -self.turn)
        return target._replace(north=north, east=east)
