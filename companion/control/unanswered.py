"""Why a sample is not answered: the one list that counts, reports and reasons are made from."""

from enum import Enum


class Unanswered(Enum):
    """A reason; its value is its name in `summary.json`."""

    ANOTHER_VEHICLE = "another_vehicle"
    NOT_NEWER = "not_newer"
    AHEAD = "stamped_ahead"
    LATE = "late"
    NO_TARGET = "no_target"
    OLD_TARGET = "old_target"
    AWAITING_MODE = "awaiting_mode"
    INVALID_ATTITUDE = "invalid_attitude"
    INVALID_SETPOINT = "invalid_setpoint"
    NOT_SENT = "not_sent"

    @property
    def words(self) -> str:
        """What is wrong while it lasts."""
        return _WORDS[self]

    @property
    def is_refusal(self) -> bool:
        """Whether the sample was good but there was no answer; else the data were stale."""
        return self in _REFUSALS


_WORDS = {
    Unanswered.ANOTHER_VEHICLE: "another vehicle may be there than was checked",
    Unanswered.NOT_NEWER: "the vehicle's clock stands still: attitude is stamped no later than "
    "before",
    Unanswered.AHEAD: "attitude is stamped far ahead of the vehicle's clock",
    Unanswered.LATE: "attitude arrives later than deadman.telemetry_stale_ms",
    Unanswered.NO_TARGET: "guidance makes no commands",
    Unanswered.OLD_TARGET: "guidance makes no commands any more",
    Unanswered.AWAITING_MODE: "after a gap in telemetry the autopilot did not confirm offboard",
    Unanswered.INVALID_ATTITUDE: "attitude from the vehicle cannot be used: it is no unit "
    "quaternion",
    Unanswered.INVALID_SETPOINT: "the setpoints cannot be used: they are not finite or out of "
    "range",
    Unanswered.NOT_SENT: "setpoints cannot leave: the connection does not take them",
}
_REFUSALS = {
    Unanswered.INVALID_ATTITUDE,
    Unanswered.INVALID_SETPOINT,
    Unanswered.NOT_SENT,
}
