"""The record of the control loop: counters, latest times, and why samples are unanswered."""

from collections import deque
from dataclasses import dataclass, field
from enum import Enum
from math import inf

from companion.attitude import AttitudeError, BodyRates
from companion.attitude.types import InvalidBodyRatesError, InvalidQuaternionError
from companion.vehicle.interval_sums import IntervalSums
from companion.vehicle.records import AttitudeSample

_KEPT_SETPOINTS = 512
"""Number of latest setpoints that are kept; at 400 Hz more than a second."""
_KEPT_GAPS = 32
"""Number of latest gaps that are kept; a flight ends after far fewer gaps."""


class UnansweredReason(Enum):
    """Why a sample is unanswered. The value is the reason's name in `summary.json` and reports."""

    ANOTHER_VEHICLE = "another_vehicle"
    NOT_NEWER = "not_newer"
    STAMPED_AHEAD = "stamped_ahead"
    LATE = "late"
    NO_TARGET = "no_target"
    OLD_TARGET = "old_target"
    AWAITING_MODE = "awaiting_mode"
    INVALID_ATTITUDE = "invalid_attitude"
    INVALID_SETPOINT = "invalid_setpoint"
    NOT_SENT = "not_sent"
    INVALID_RATES = "invalid_rates"

    @classmethod
    def of(cls, error: AttitudeError) -> "UnansweredReason":
        """The reason for a planner's error: an invalid attitude, or invalid rates."""
        if isinstance(error, InvalidQuaternionError | InvalidBodyRatesError):
            return cls.INVALID_ATTITUDE
        return cls.INVALID_RATES

    @property
    def text(self) -> str:
        """The reason in words, for messages."""
        return _REASON_TEXTS[self]

    @property
    def is_refusal(self) -> bool:
        """Whether the data were fresh, but no valid setpoint could be computed or sent."""
        return self in _REFUSALS


_REASON_TEXTS = {
    UnansweredReason.ANOTHER_VEHICLE: "this may be another vehicle than the one that was checked",
    UnansweredReason.NOT_NEWER: "the vehicle's clock stands still: new attitude samples carry no "
    "later time stamp",
    UnansweredReason.STAMPED_AHEAD: "attitude is stamped far ahead of the vehicle's clock",
    UnansweredReason.LATE: "attitude arrives, but older than deadman.telemetry_stale_ms",
    UnansweredReason.NO_TARGET: "guidance makes no commands",
    UnansweredReason.OLD_TARGET: "guidance makes no commands any more",
    UnansweredReason.AWAITING_MODE: "after a gap in telemetry the autopilot did not confirm "
    "offboard",
    UnansweredReason.INVALID_ATTITUDE: "attitude from the vehicle cannot be used: it is no unit "
    "quaternion",
    UnansweredReason.INVALID_SETPOINT: "the setpoints cannot be used: they are not finite or out "
    "of range",
    UnansweredReason.NOT_SENT: "setpoints cannot be sent: the connection does not accept them",
    UnansweredReason.INVALID_RATES: "the planner gives no body rates: they are NaN or infinite, or "
    "it refuses the target",
}
_REFUSALS = {
    UnansweredReason.INVALID_ATTITUDE,
    UnansweredReason.INVALID_SETPOINT,
    UnansweredReason.NOT_SENT,
    UnansweredReason.INVALID_RATES,
}


@dataclass(frozen=True, slots=True)
class Deadlines:
    """Times after which data are too old or a setpoint is too late."""

    telemetry_stale: float
    """Largest age of a sample that is answered, s."""
    target_stale: float
    """Largest age of a command from guidance that is used, s."""
    deadline: float
    """Largest time from a sample's arrival to its setpoint that is not counted as missed, s."""


@dataclass(slots=True)
class LoopRecord:
    """Counters since the loop was made, and latest times."""

    samples: int = 0
    """Samples received while the loop was on."""
    setpoints: int = 0
    missed_deadlines: int = 0
    """Setpoints sent later than `Deadlines.deadline` after their sample."""
    unanswered: dict[UnansweredReason, int] = field(
        default_factory=lambda: dict.fromkeys(UnansweredReason, 0)
    )
    """Unanswered samples, by reason."""
    reason: UnansweredReason | None = None
    """Why the newest sample is unanswered, or None."""
    latency_ns: int = 0
    """Time from the arrival of the last answered sample to its setpoint, ns."""
    sent_setpoints: deque[tuple[BodyRates, float]] = field(
        default_factory=lambda: deque(maxlen=_KEPT_SETPOINTS)
    )
    """Body rates (rad/s) and thrust of the latest setpoints, the newest last."""
    last_sample_arrival: float = -inf
    """When the newest sample arrived, s of event-loop time."""
    last_vehicle_time: float = -inf
    """Vehicle time of the newest sample that fits the vehicle's clock, s."""
    last_answered_arrival: float = -inf
    """When the newest answered sample arrived, s of event-loop time."""
    gap_start: float = inf
    """Time from which the present gap between setpoints counts: `last_answered_arrival`; inf
    (no gap) before the first answer and after `ControlLoop.resume`."""
    gaps: deque[float] = field(default_factory=lambda: deque(maxlen=_KEPT_GAPS))
    """Ends of the latest gaps, s of event-loop time: arrival of the first sample that could be
    answered. A gap is a time longer than `Deadlines.telemetry_stale` without a setpoint, while
    offboard is active or requested."""
    setpoint_intervals: IntervalSums = field(default_factory=IntervalSums)
    """Time from each setpoint to the next one, without gaps, s."""

    def note_arrival(self, sample: AttitudeSample) -> float:
        """Note an arrived sample; return the time since `last_vehicle_time`, s of vehicle time."""
        self.last_sample_arrival = sample.received
        period = sample.vehicle_time - self.last_vehicle_time
        if sample.misfit is None:
            self.last_vehicle_time = sample.vehicle_time
        return period

    def note_answer(
        self, sample_arrival: float, rates: BodyRates, thrust: float, longest_interval: float
    ) -> None:
        """Note that a setpoint was sent.

        Args:
            sample_arrival: when its sample arrived, s of event-loop time.
            rates: body rates of the setpoint, rad/s.
            thrust: thrust of the setpoint, 0..1.
            longest_interval: a longer interval between setpoints is a gap, s.
        """
        self.setpoints += 1
        self.sent_setpoints.append((rates, thrust))
        setpoint_interval = sample_arrival - self.last_answered_arrival
        if setpoint_interval <= longest_interval:
            self.setpoint_intervals.add(setpoint_interval)
        self.last_answered_arrival = self.gap_start = sample_arrival

    @property
    def thrust(self) -> float:
        """The thrust last sent, 0..1; 0 before the first setpoint."""
        return self.sent_setpoints[-1][1] if self.sent_setpoints else 0.0

    @property
    def stale_count(self) -> int:
        """Number of samples not answered for a reason that is no refusal, such as stale data."""
        return sum(n for reason, n in self.unanswered.items() if not reason.is_refusal)

    @property
    def refused_count(self) -> int:
        """Number of samples for which no valid setpoint could be computed or sent."""
        return sum(n for reason, n in self.unanswered.items() if reason.is_refusal)
