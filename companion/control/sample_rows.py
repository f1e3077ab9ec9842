"""Converts the control loop's record of a sample to messages of `flight.mcap`.

The control loop passes its objects to the recorder. In the recorder's thread, the functions here
write the numbers of these objects in the order of the columns in
`companion.recording.mcap_file.loop_channels`.
"""

from math import nan, sqrt
from typing import NamedTuple

from companion.attitude import BodyRates, Limits, Quaternion, Target
from companion.attitude.history import PlannedTilt
from companion.attitude.kinematics import half_tilt_products
from companion.control.loop_record import UnansweredReason
from companion.recording.mcap_file.loop_channels import (
    ATTITUDE_TARGET,
    SAMPLE,
    SETPOINT,
    UNANSWERED_CODES,
)
from companion.recording.mcap_file.writer import McapWriter
from companion.vehicle.clock_jumps import Misfit
from companion.vehicle.records import AttitudeSample, AttitudeTarget

_REASON_CODES: dict[UnansweredReason | None, int] = {None: 0}
_REASON_CODES.update({reason: UNANSWERED_CODES.index(reason.value) for reason in UnansweredReason})
_CONTROL_OFF = UNANSWERED_CODES.index("control_off")
_MISFIT_CODES = {None: 0, Misfit.NOT_NEWER: 1, Misfit.AHEAD: 2}
_LIMIT_REACHED_SHARE = 1.0 - 1e-9
"""A body rate of at least this share of its limit counts as limited."""
_NO_TARGET = Target(nan, nan, nan, nan)


class LoopFlags(NamedTuple):
    """The state of the control loop when a sample arrived; attributes as in `ControlLoop`.

    `same_vehicle` is what `is_same_vehicle` returned.
    """

    on: bool
    taking_over: bool
    offboard_active: bool
    awaiting_mode: bool
    same_vehicle: bool


class Answer(NamedTuple):
    """A setpoint that was sent, and the inputs from which it was computed."""

    rates: BodyRates
    """Body rates, rad/s."""
    thrust: float
    """Thrust, 0..1."""
    latency_ns: int
    """Time from the sample's arrival to the setpoint, ns."""
    planner_input: tuple[Quaternion, Target] | None
    """Attitude and target that the planner got; None: the planner was not asked, because guidance
    commanded body rates or idle."""
    planned_tilt: PlannedTilt | None
    """Coefficients planned by `model-following` at the sample, or None."""
    is_step: bool
    """Whether the setpoint belongs to an open-loop step whose response is measured."""
    idle: bool
    """Whether zero body rates and zero thrust were sent, on the ground."""


class SampleEntry(NamedTuple):
    """A sample that reached the control loop."""

    sample: AttitudeSample
    reason: UnansweredReason | None
    """Why the newest sample is unanswered, or None; ignored if the loop was off."""
    flags: LoopFlags
    """State of the loop before the answer."""
    checked_at: float
    """When the sample's age was checked before sending, s of event-loop time; NaN: not checked."""
    answer: Answer | None
    """Setpoint that was sent, or None."""


class SampleWriter:
    """Writes the numeric channels of the control loop.

    Args:
        thrust_limits: smallest and largest thrust that is sent, 0..1.
    """

    def __init__(self, limits: Limits, thrust_limits: tuple[float, float]) -> None:
        self._tilt_rate_threshold = _LIMIT_REACHED_SHARE * limits.tilt_rate
        self._yaw_rate_threshold = _LIMIT_REACHED_SHARE * limits.yaw_rate
        self._thrust_limits = thrust_limits

    def sample(self, writer: McapWriter, time_ns: int, entry: SampleEntry) -> None:
        """Write a sample, and the setpoint that answers it."""
        sample, reason, flags, checked_at, answer = entry
        reason_code = _REASON_CODES[reason] if flags.on else _CONTROL_OFF
        row = (
            sample.received,
            sample.vehicle_time,
            sample.time_boot_ms,
            sample.age,
            *sample.q,
            *sample.body_rates,
            checked_at,
            reason_code,
            _MISFIT_CODES[sample.misfit],
            sample.age_known,
            *flags,
        )
        writer.row(SAMPLE, time_ns, row)
        if answer is not None:
            writer.row(SETPOINT, time_ns, self._setpoint(sample, flags, answer))

    def attitude_target(self, writer: McapWriter, time_ns: int, target: AttitudeTarget) -> None:
        """Write a new ATTITUDE_TARGET."""
        writer.row(ATTITUDE_TARGET, time_ns, (target.time_boot_ms, *target.q))

    def _setpoint(
        self, sample: AttitudeSample, flags: LoopFlags, answer: Answer
    ) -> tuple[float, ...]:
        rates, thrust, latency_ns, planner_input, planned_tilt, is_step, idle = answer
        q, target = planner_input or (sample.q, _NO_TARGET)
        _, ax, ay = half_tilt_products(*q)
        roll, pitch, yaw = rates
        return (
            sample.received,
            sample.vehicle_time,
            *rates,
            thrust,
            1e-3 * latency_ns,
            *target,
            *q,
            -2.0 * ay,
            2.0 * ax,
            *((nan, nan) if planned_tilt is None else planned_tilt[:2]),
            # A program's own rates may be NumPy's, whose truth values cannot be packed.
            bool(sqrt(roll * roll + pitch * pitch) >= self._tilt_rate_threshold),
            bool(abs(yaw) >= self._yaw_rate_threshold),
            not idle and thrust in self._thrust_limits,
            bool(flags.offboard_active),
            bool(is_step),
            bool(idle),
        )
