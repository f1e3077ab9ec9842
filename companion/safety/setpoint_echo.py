"""Finds setpoints of another program, in what the autopilot reports that it obeys."""

from collections import deque

from companion.attitude import BodyRates
from companion.mavlink.messages import Message

_COUNTING_TIME = 5.0
_KEPT_REPORTS = 256
_TOLERANCE = 1e-5
"""Largest difference from a setpoint of ours, rad/s or share of the full thrust: ATTITUDE_TARGET
has numbers of single precision."""


class SetpointEcho:
    """Compares the autopilot's ATTITUDE_TARGET with the setpoints that this program sent.

    While an autopilot obeys body rates, PX4 reports the rates of the newest setpoint, and
    ArduPilot its thrust. In eight flights of each real autopilot every report did. So a report that
    fits neither shows that another program sends setpoints, too: the autopilots obey whoever sends.

    Args:
        sent: the latest setpoints of this program, the newest last; they are appended elsewhere.
    """

    def __init__(self, sent: deque[tuple[BodyRates, float]]) -> None:
        self._sent = sent
        self._echoes = False
        self._foreign: deque[float] = deque(maxlen=_KEPT_REPORTS)

    def begin(self) -> None:
        """Note that control begins: earlier reports do not count."""
        self._echoes = False
        self._foreign.clear()

    def take(self, message: Message, now: float) -> None:
        """Take an ATTITUDE_TARGET that arrived at `now`, s of event-loop time."""
        rates = BodyRates(message.body_roll_rate, message.body_pitch_rate, message.body_yaw_rate)
        if self._is_ours(rates, message.thrust):
            self._echoes = True
        elif self._echoes:
            self._foreign.append(now)

    def foreign_reports(self, now: float) -> int:
        """Number of reports of the last 5 s that show a setpoint of another program.

        It remains 0 until a report has shown a setpoint of ours: the autopilot may change them.
        """
        return sum(now - at <= _COUNTING_TIME for at in self._foreign)

    def _is_ours(self, rates: BodyRates, thrust: float) -> bool:
        return any(
            abs(thrust - sent_thrust) <= _TOLERANCE or _near(rates, sent_rates)
            for sent_rates, sent_thrust in reversed(self._sent)
        )


def _near(first: BodyRates, second: BodyRates) -> bool:
    return all(abs(a - b) <= _TOLERANCE for a, b in zip(first, second, strict=True))
