"""Frames whose north is rotated from the north of the autopilot's estimator."""

from math import exp, radians
from typing import NamedTuple

from companion.attitude import BodyRates, Quaternion, Target
from companion.attitude.reference import first_order_step
from companion.attitude.rotation import clamp, down_in_body, turned_about_vertical
from companion.guidance.reference import rotate

_LARGEST_OFFSET = radians(3.0)
"""Largest offset of a `StepFrame`, rad; limits the effect of a wrong gyro."""
_DECAY_S = 2.0
"""Time constant with which the offset of a `StepFrame` decays after the steps, s."""
_ATTITUDE_CONTROL_TIME_S = 1.0 / 4.5
"""Time constant with which ArduPilot's attitude controller follows its target (ATC_ANG_*_P), s."""


class HeadingFrame(NamedTuple):
    """Converts headings, attitudes and targets between the estimator's frame and this one."""

    offset: float = 0.0
    """Heading in the estimator's frame minus heading in this frame, rad."""

    def heading(self, estimated: float) -> float:
        """The heading in this frame, from the heading in the estimator's frame; rad."""
        return estimated - self.offset

    def estimated_heading(self, heading: float) -> float:
        """The heading in the estimator's frame, from the heading in this frame; rad."""
        return heading + self.offset

    def attitude(self, estimated: Quaternion) -> Quaternion:
        """The attitude in this frame, from the attitude in the estimator's frame."""
        return estimated if self.offset == 0.0 else turned_about_vertical(estimated, -self.offset)

    def target(self, target: Target) -> Target:
        """Convert a target of guidance to this frame.

        The given target has its horizontal part in the estimator's frame, and its heading in this
        frame already.
        """
        if self.offset == 0.0:
            return target
        north, east = rotate(target.north, target.east, -self.offset)
        return target._replace(north=north, east=east)


class StepFrame:
    """The frame of open-loop steps, in which the estimator's heading corrections are left out.

    A step should be a straight line in the world. An estimator corrects its heading most when the
    vehicle accelerates after a hover: by 1.3° within the first step on ArduCopter's simulator,
    which bends the line of the coefficients by 0.015. The body rates show no turn. So while steps
    are flown, the planner sees an attitude without the heading changes that body rates do not
    explain.

    In closed loop, guidance computes each acceleration in the estimator's frame. The horizontal
    target is rotated together with the attitude, so the acceleration stays as guidance commands it.
    The offset of this frame decays. The heading target is not rotated, because it would jump where
    steps begin and end.

    ArduPilot takes body rates along an attitude target that stays in the estimator's frame, so the
    vehicle follows each correction: it turns about the vertical, and when tilted its thrust axis
    turns, too. For this autopilot, the rotation of the frame is added to the body rates.

    Attributes:
        frame: converts attitudes from the estimator's frame to this frame. Targets of open-loop
            steps are in this frame already.
        offset_rate: rate of the frame's `offset`, low-passed, rad/s.
    """

    def __init__(self) -> None:
        self.frame = HeadingFrame()
        self.offset_rate = 0.0
        self._corrections_at_zero = 0.0  # `heading_corrections` at which the offset is 0

    def advance(self, corrections: float, dt: float, *, stepping: bool) -> None:
        """Follow the estimator's corrections during steps; let the offset decay otherwise.

        Args:
            corrections: sum of all heading changes that body rates do not explain, rad.
            dt: time since the last call, s.
            stepping: whether an open-loop step is flown.
        """
        offset_before = self.frame.offset
        if stepping:
            offset = clamp(corrections - self._corrections_at_zero, _LARGEST_OFFSET)
        else:
            offset = offset_before * exp(-dt / _DECAY_S)
            self._corrections_at_zero = corrections - offset
        self.frame = HeadingFrame(offset)
        if dt > 0.0:
            change_rate = (offset - offset_before) / dt
            _, self.offset_rate = first_order_step(
                self.offset_rate, change_rate, _ATTITUDE_CONTROL_TIME_S, dt
            )

    def rates(self, q: Quaternion, rates: BodyRates) -> BodyRates:
        """Body rates in the estimator's frame, from body rates in this frame at attitude `q`."""
        rate = self.offset_rate
        if rate == 0.0:
            return rates
        x, y, z = down_in_body(q)
        return BodyRates(rates.roll + x * rate, rates.pitch + y * rate, rates.yaw + z * rate)
