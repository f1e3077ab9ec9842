"""Makes the command of one guidance step from the reference and the estimated motion."""

from dataclasses import dataclass, field
from functools import cache
from math import isfinite

from companion.control.flown_source import FlownSource
from companion.control.guidance_command import GuidanceCommand
from companion.control.heading_frame import HeadingFrame
from companion.control.hover_learning import HoverLearning
from companion.control.motion_estimate import MotionEstimate
from companion.control.predictive import PredictiveControl
from companion.guidance import GRAVITY, GuidanceInput, Reference
from companion.guidance.linear import Guidance


@dataclass(eq=False)
class CommandMaker:
    """Asks guidance or predictive control for a command, and limits the tilt of its target."""

    guidance: Guidance
    """Makes targets from references."""
    _flown_source: FlownSource
    _estimate: MotionEstimate
    """Provides the state of the vehicle, and needs the commanded vertical thrust."""
    _learning: HoverLearning
    """Provides the largest tilt and the thrust limits."""
    _period: float
    """Period of guidance, s."""
    predictive_control: PredictiveControl | None = field(default=None, init=False)
    """Flies trajectories instead of `guidance`; None: `guidance` flies them."""

    def guidance_input(self, now: float) -> GuidanceInput:
        """Estimate the motion now, and predict it for the time when a command takes effect.

        `now`: event-loop time, s.

        Raises:
            RuntimeError: no position has come yet.
        """
        return self._estimate.guidance_input(
            now, self.guidance.effect_delay, self._learning.thrust_limits
        )

    def make(
        self,
        now: float,
        inputs: GuidanceInput,
        heading: float,
        frame: HeadingFrame,
        *,
        offboard_active: bool,
    ) -> tuple[Reference, GuidanceCommand | None]:
        """The reference at `now` and its command, which is None if guidance gave NaN or infinity.

        Args:
            now: event-loop time, s.
            inputs: motion of the vehicle, wind, drag and thrust limits.
            heading: present heading of the vehicle, rad.
            frame: the frame that heading resets do not turn.
            offboard_active: whether the autopilot obeys the setpoints.
        """
        # Target and heading are made from references at the same times.
        reference_at = cache(self._flown_source.reference(now, inputs.present, heading))
        reference = reference_at(now)
        guidance_output = self.guidance.command(reference_at, now, inputs)
        if self.predictive_control is not None:
            vehicle = self._estimate.vehicle(now, inputs)
            followed_trajectory = self._flown_source.followed_trajectory(now)
            guidance_output = self.predictive_control.replacement_for(
                guidance_output, frame, vehicle, followed_trajectory
            )
        target, later_target, acceleration_down = guidance_output
        # Open-loop steps, predictive control and `InnerResponse.target` ignore the learned limit.
        target, later_target = (
            self._learning.limit_tilt(each, acceleration_down) for each in (target, later_target)
        )
        if not all(map(isfinite, (*target, *later_target, acceleration_down))):
            return reference, None
        # Guidance of another package may want more thrust than there is; it does not accelerate.
        vertical_thrust = min(max(0.0, GRAVITY - acceleration_down), inputs.thrust_limits[1])
        self._estimate.vertical_thrust = vertical_thrust if offboard_active else GRAVITY
        command = GuidanceCommand(
            target,
            acceleration_down,
            now,
            is_step=reference.coefficients is not None and reference.thrust is None,
            body_rates=reference.body_rates,
            thrust=reference.thrust,
            frame=frame,
            later_target=later_target,
            period=self._period,
        )
        return reference, command
