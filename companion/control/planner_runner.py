"""Runs the planner on each sample: periods, restarts, and the frame that the planner sees."""

from collections.abc import Callable
from math import inf

from companion.attitude import BodyRates, Planner, Quaternion, Target
from companion.control.estimator_resets import EstimatorResets
from companion.control.step_frame import StepFrame
from companion.vehicle.records import AttitudeSample, AttitudeTarget

_LONGEST_STEP = 0.1
"""Longest period that a planner integrates over, s; after a longer one it is reset."""


class PlannerRunner:
    """Asks the planner for body rates, in a frame without estimator resets.

    During open-loop steps that is the `StepFrame`.

    Args:
        planner: the planner.
        resets: the estimator resets, which the planner must not see.

    Attributes:
        attitude_target: returns the newest ATTITUDE_TARGET of an autopilot that takes body rates
            along its axes, or None.
    """

    def __init__(self, planner: Planner, resets: EstimatorResets) -> None:
        self.attitude_target: Callable[[], AttitudeTarget | None] = lambda: None
        self._planner = planner
        self._resets = resets
        self._frame = StepFrame()
        self._planned_at = -inf
        self._period = 0.0
        self._noted: AttitudeTarget | None = None
        self._turn, self._turned_ms = 0.0, -1

    def restart(self) -> None:
        """Reset the planner at the next sample, because its state is not valid any more."""
        self._planned_at = -inf

    def attitude(self, q: Quaternion) -> Quaternion:
        """An attitude of the autopilot in the frame that the planner sees."""
        return self._frame.attitude(self._resets.attitude(q))

    def rates(
        self, sample: AttitudeSample, target: Target, arrival_period: float, *, is_step: bool
    ) -> BodyRates:
        """Body rates for a sample, rad/s; resets the planner first after a gap or a restart.

        Args:
            sample: the sample to answer.
            target: target in the frame without resets.
            arrival_period: vehicle time since the sample before, s.
            is_step: whether the target is an open-loop step.

        Raises:
            AttitudeError: the planner cannot use this attitude or target.
        """
        period = sample.vehicle_time - self._planned_at
        # Over a gap the body rates are not known, so the frame does not follow the estimator.
        stepping = is_step and period <= _LONGEST_STEP
        self._frame.advance(self._resets.corrections, min(abs(period), 10.0), stepping=stepping)
        q = self.attitude(sample.q)
        if not is_step:
            target = self._frame.target(target)
        if period > _LONGEST_STEP:
            self._planner.reset(q, sample.body_rates)
            # A gap is not the period of the samples, so an earlier period is used.
            period = self._period or min(arrival_period, _LONGEST_STEP)
        self._period = period
        self._planned_at = sample.vehicle_time
        self._note_attitude_target(sample)
        return self._planner.rates(q, target, period, sample.body_rates)

    def _note_attitude_target(self, sample: AttitudeSample) -> None:
        """Pass a new ATTITUDE_TARGET to the planner once a sample is at least as new.

        One from before a heading reset is ignored, because its frame is not known.
        """
        if self._resets.turn != self._turn:
            self._turn, self._turned_ms = self._resets.turn, sample.time_boot_ms
        target = self.attitude_target()
        if target is None or target is self._noted:
            return
        if self._turned_ms < target.time_boot_ms <= sample.time_boot_ms:
            self._noted = target
            age = 1e-3 * (sample.time_boot_ms - target.time_boot_ms)
            self._planner.note_attitude_target(self.attitude(target.q), age)
