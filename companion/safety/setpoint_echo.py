"""Detects setpoints of another program in the ATTITUDE_TARGET that the autopilot reports."""

from collections import deque
from math import isfinite

from companion.attitude import BodyRates
from companion.mavlink.messages import Message
from companion.vehicle.autopilot import Autopilot

_COUNTING_WINDOW = 5.0
_KEPT_REPORTS = 256
_THRUST_ROUNDING, _RATE_ROUNDING = 1e-7, 1e-6
"""Largest difference of a reported thrust (0..1) and body rate (rad/s) from our setpoint, because
ATTITUDE_TARGET has single precision."""


class SetpointEcho:
    """Compares the autopilot's ATTITUDE_TARGET with the setpoints that this program sent.

    While an autopilot obeys body rates, it reports the rates of the newest setpoint (PX4) or its
    thrust (ArduPilot), as every report of recorded flights confirms. So a report that matches none
    of our setpoints shows that another program sends setpoints, too; the autopilot obeys both.

    Attributes:
        any_foreign: whether a report since control began showed a setpoint of another program.

    Args:
        sent: the latest setpoints of this program, the newest last; the control loop appends them.
    """

    def __init__(self, sent: deque[tuple[BodyRates, float]]) -> None:
        self._sent = sent
        self._compares_thrust = False
        self._matched_once = self.any_foreign = False
        self._foreign_times: deque[float] = deque(maxlen=_KEPT_REPORTS)

    def begin(self, autopilot: Autopilot) -> None:
        """Note that control of this autopilot begins: earlier reports do not count."""
        # With rates about the axes of its target, an autopilot reports the rates of that target.
        self._compares_thrust = autopilot.rates_about_target_axes
        self._matched_once = self.any_foreign = False
        self._foreign_times.clear()

    def add_report(self, message: Message, now: float) -> None:
        """Add an ATTITUDE_TARGET that arrived at `now`, s of event-loop time."""
        rates = BodyRates(message.body_roll_rate, message.body_pitch_rate, message.body_yaw_rate)
        if self._is_ours(rates, message.thrust):
            self._matched_once = True
        elif self._matched_once and isfinite(sum(rates) + message.thrust):
            self.any_foreign = True
            self._foreign_times.append(now)

    def foreign_reports(self, now: float) -> int:
        """Number of reports of the last 5 s that show a setpoint of another program.

        The number remains 0 until a report has matched one of our setpoints, because an autopilot
        may report changed setpoints.
        """
        return sum(now - at <= _COUNTING_WINDOW for at in self._foreign_times)

    def _is_ours(self, rates: BodyRates, thrust: float) -> bool:
        newest_first = reversed(self._sent)
        if self._compares_thrust:
            return any(abs(thrust - sent) <= _THRUST_ROUNDING for _, sent in newest_first)
        return any(
            all(abs(a - b) <= _RATE_ROUNDING for a, b in zip(rates, sent, strict=True))
            for sent, _ in newest_first
        )
