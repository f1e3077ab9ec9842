"""Runs the planner on each sample; provides sample period, restarts and the attitude's frame."""

from collections.abc import Callable
from math import inf

from companion.attitude import BodyRates, Constants, LawPlanner, Limits, Planner, Quaternion, Target
from companion.attitude.history import PlannedTilt
from companion.attitude.model_following import SHORTEST_PERIOD, ModelFollowingPlanner
from companion.attitude.rotation import limit_rates
from companion.control.estimator_resets import EstimatorResets
from companion.control.guidance_command import GuidanceCommand
from companion.control.heading_frame import HeadingFrame, StepFrame
from companion.vehicle.records import AttitudeSample, AttitudeTarget

_LONGEST_PERIOD = 0.1
"""Longest sample period that a planner gets, s; after a longer one the planner is reset."""


class PlannerRunner:
    """Asks the planner for body rates; attitude and target are in a frame that resets do not turn.

    During open-loop steps, and for seconds after them, this frame is the `StepFrame`.

    Args:
        resets: the estimator resets, which the planner must not see.

    Attributes:
        attitude_target: returns the newest ATTITUDE_TARGET of an autopilot that takes body rates
            along the axes of that target (ArduPilot), or None.
        on_attitude_target: called with each new ATTITUDE_TARGET before the planner gets it.
        planner_input: attitude and target that the planner last got, or None.
    """

    def __init__(self, planner: Planner, resets: EstimatorResets, limits: Limits) -> None:
        self.attitude_target: Callable[[], AttitudeTarget | None] = lambda: None
        self.on_attitude_target: Callable[[AttitudeTarget], None] | None = None
        self.planner_input: tuple[Quaternion, Target] | None = None
        self._planner = planner
        self._model_follower = planner if isinstance(planner, ModelFollowingPlanner) else None
        self._estimator_resets, self._limits = resets, limits
        self._step_frame = StepFrame()
        self._last_plan_time = -inf
        self._period = 0.0
        self._planner_attitude_target: AttitudeTarget | None = None
        self._reported_attitude_target: AttitudeTarget | None = None
        self._frame_after_reset, self._reset_time_boot_ms = HeadingFrame(), -1

    def retune(self, constants: Constants, limits: Limits) -> None:
        """Use other gains and limits from the next sample on.

        Raises:
            TypeError: the planner is of another package and cannot change them.
        """
        if not isinstance(self._planner, LawPlanner | ModelFollowingPlanner):
            raise TypeError(
                f"the values of {type(self._planner).__name__} cannot be changed in flight"
            )
        self._planner.retune(constants)
        self._limits = limits

    def restart(self) -> None:
        """Reset the planner at the next sample, because its state is not valid any more."""
        self._last_plan_time = -inf

    @property
    def planned_tilt(self) -> PlannedTilt | None:
        """Coefficients planned by `model-following` at the newest sample; None: another planner."""
        return None if self._model_follower is None else self._model_follower.plan_in_effect

    def attitude(self, q: Quaternion) -> Quaternion:
        """An attitude of the autopilot in the frame that the planner sees."""
        return self._step_frame.frame.attitude(self._estimator_resets.frame.attitude(q))

    def rates(
        self, sample: AttitudeSample, command: GuidanceCommand, arrival_period: float
    ) -> BodyRates:
        """Body rates for a sample, rad/s, limited: those in the command, or else the planner's.

        `arrival_period`: vehicle time from the previous usable sample to this one, s.

        Raises:
            AttitudeError: the planner cannot use this attitude or target.
        """
        rates = command.body_rates
        if rates is None:
            target = command.frame.target(command.target_at(sample.received - sample.age))
            rates = self._planned_rates(sample, target, arrival_period, is_step=command.is_step)
        limits = self._limits
        return BodyRates(*limit_rates(*rates, limits.tilt_rate, limits.yaw_rate))

    def _planned_rates(
        self, sample: AttitudeSample, target: Target, arrival_period: float, *, is_step: bool
    ) -> BodyRates:
        """Ask the planner; reset it first after a gap or a restart.

        `target` is in the frame that heading resets do not turn.
        """
        period = sample.vehicle_time - self._last_plan_time
        # Over a gap the body rates are not known, so the frame does not follow the estimator.
        stepping = is_step and period <= _LONGEST_PERIOD
        self._step_frame.advance(
            self._estimator_resets.heading_corrections, min(abs(period), 10.0), stepping=stepping
        )
        q = self.attitude(sample.q)
        if not is_step:
            target = self._step_frame.frame.target(target)
        if period > _LONGEST_PERIOD:
            self._planner.reset(q, sample.body_rates)
            # A gap is not the period of the samples, so an earlier period is used.
            period = self._period or min(arrival_period, _LONGEST_PERIOD)
        self._period = period
        self._last_plan_time = sample.vehicle_time
        self._note_attitude_target(sample)
        self.planner_input = q, target
        # A vehicle's clock that stood still or went back must not keep the sample unanswered.
        rates = self._planner.rates(q, target, max(SHORTEST_PERIOD, period), sample.body_rates)
        return rates if self._planner_attitude_target is None else self._step_frame.rates(q, rates)

    def _note_attitude_target(self, sample: AttitudeSample) -> None:
        """Pass a new ATTITUDE_TARGET to the planner, unless `sample` is older than the message.

        An ATTITUDE_TARGET from before a heading reset is ignored: its frame is not known.
        """
        if self._estimator_resets.frame != self._frame_after_reset:
            self._frame_after_reset = self._estimator_resets.frame
            self._reset_time_boot_ms = sample.time_boot_ms
        target = self.attitude_target()
        if target is None or target is self._planner_attitude_target:
            return
        if target is not self._reported_attitude_target and self.on_attitude_target is not None:
            self._reported_attitude_target = target
            self.on_attitude_target(target)
        if self._reset_time_boot_ms < target.time_boot_ms <= sample.time_boot_ms:
            self._planner_attitude_target = target
            age = 1e-3 * (sample.time_boot_ms - target.time_boot_ms)
            self._planner.note_attitude_target(self.attitude(target.q), age)
