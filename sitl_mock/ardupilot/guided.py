"""The task of GUIDED, and the attitude setpoints that it accepts."""

from enum import Enum, auto
from math import isnan

from sitl_mock.autopilot.setpoints import (
    ATTITUDE_IGNORED,
    ROLL_OR_PITCH_RATE_IGNORED,
    THROTTLE_IGNORED,
    YAW_RATE_IGNORED,
    AttitudeSetpoint,
    Setpoint,
)
from sitl_mock.link.framing import Message

_ALL_RATES_IGNORED = ROLL_OR_PITCH_RATE_IGNORED | YAW_RATE_IGNORED
_UNIT_LENGTH_TOLERANCE = 1e-3
"""Largest accepted difference of a quaternion's squared length from 1."""


class FatalSetpointError(Exception):
    """A setpoint that crashes ArduPilot: an attitude with NaN (measured: SIGFPE)."""


def attitude_setpoint(message: Message) -> AttitudeSetpoint | None:
    """Decode a SET_ATTITUDE_TARGET by ArduCopter's type-mask rules (measured).

    Return None if the mask ignores the throttle or only some of the rates, or if the attitude is
    not of unit length; the vehicle then holds its position. Rates may be NaN or infinite.

    Raises:
        FatalSetpointError: the attitude has a NaN.
    """
    mask = message.type_mask
    ignored_rates = mask & _ALL_RATES_IGNORED
    if mask & THROTTLE_IGNORED or ignored_rates not in (0, _ALL_RATES_IGNORED):
        return None
    rates = (message.body_roll_rate, message.body_pitch_rate, message.body_yaw_rate)
    rates = (0.0, 0.0, 0.0) if ignored_rates else rates
    if mask & ATTITUDE_IGNORED:
        return AttitudeSetpoint(None, rates, rates[2], message.thrust)
    w, x, y, z = message.q
    squared_length = w * w + x * x + y * y + z * z
    if isnan(squared_length):
        raise FatalSetpointError
    if abs(squared_length - 1.0) > _UNIT_LENGTH_TOLERANCE:
        return None
    return AttitudeSetpoint((w, x, y, z), rates, rates[2], message.thrust)


class Task(Enum):
    """Submodes of GUIDED."""

    HOLD = auto()
    TAKE_OFF = auto()
    ANGLE = auto()
    """Follow an `AttitudeSetpoint`: rates or an attitude, with thrust."""
    POSITION = auto()
    """Follow a `PositionSetpoint`."""


class Guided:
    """The task of GUIDED and its setpoint. A new task replaces any other, even a take-off."""

    def __init__(self) -> None:
        self.task = Task.HOLD
        self.takeoff_height = 0.0
        """Height at which a take-off ends, m above home."""
        self.setpoint: Setpoint | None = None
        self.setpoint_us = 0
        """Vehicle time at which the latest setpoint was received, us."""
        self.task_changed = True
        """Whether the task began after the last `GuidedFlight.command`."""

    def hold(self) -> None:
        """Hold the present position."""
        self._begin(Task.HOLD)

    def end_takeoff(self) -> None:
        """End a take-off: hold the position that it reached."""
        self.task = Task.HOLD

    def take_off(self, height: float) -> None:
        """Climb to a height above home, m."""
        self.takeoff_height = height
        self._begin(Task.TAKE_OFF)

    def follow(self, setpoint: Setpoint, now_us: int) -> None:
        """Follow a setpoint that was received at `now_us`."""
        task = Task.ANGLE if isinstance(setpoint, AttitudeSetpoint) else Task.POSITION
        self.setpoint, self.setpoint_us = setpoint, now_us
        if self.task is not task:
            self._begin(task)

    def setpoint_timed_out(self, now_us: int, timeout_s: float) -> bool:
        """Whether the latest setpoint is older than GUID_TIMEOUT (``timeout_s``)."""
        return now_us - self.setpoint_us > timeout_s * 1e6

    def _begin(self, task: Task) -> None:
        self.task = task
        self.task_changed = True
