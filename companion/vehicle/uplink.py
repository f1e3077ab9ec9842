"""Delay and loss on the link to the vehicle, by which setpoints go, measured by probes.

A probe is a TIMESYNC request that does not enter the estimate of the vehicle's clock. Setpoints
are not acknowledged, so only the answers to probes show that setpoints come late or are lost.
"""

from collections import deque
from typing import NamedTuple

_PERIOD_S = 0.1
_WINDOW_S = 0.7
"""Only probes answered within this time count, s. A link that becomes slow is noticed after about
this time; a single late answer has no effect."""
_MIN_ANSWERS = 4
_KEPT = 16
_S_PER_NS = 1e-9


class Uplink(NamedTuple):
    """Present delay and loss on the link to the vehicle.

    Attributes:
        round_trip: Shortest round trip of the probes answered in the last 0.7 s, s; None: fewer
            than four.
        unanswered: Number of probes sent since the newest one that was answered; None: the vehicle
            has not answered any TIMESYNC request.
    """

    round_trip: float | None = None
    unanswered: int | None = None


class UplinkProbes:
    """The probes sent and their answers. All times are event-loop times, ns."""

    def __init__(self) -> None:
        self._sent: deque[int] = deque(maxlen=_KEPT)
        # (arrival of the answer, round trip), ns
        self._round_trips: deque[tuple[int, int]] = deque(maxlen=_KEPT)
        self._unanswered: int | None = None

    def due(self, now: int) -> bool:
        """Whether the next probe should be sent; at most ten are sent in a second."""
        return not self._sent or now - self._sent[-1] >= _PERIOD_S / _S_PER_NS

    def note_sent(self, stamp: int) -> None:
        """Remember the probe that was sent at `stamp`; its answer will contain this time."""
        self._sent.append(stamp)
        if self._unanswered is not None:
            self._unanswered += 1

    def __contains__(self, stamp: int) -> bool:
        """Whether a probe was sent at `stamp` a short time ago."""
        return stamp in self._sent

    def take_answer(self, stamp: int, now: int) -> None:
        """Take the answer, received `now`, to a probe or to another TIMESYNC request of ours."""
        if stamp in self._sent:
            self._round_trips.append((now, now - stamp))
        sent_later = sum(sent > stamp for sent in self._sent)
        self._unanswered = min(sent_later, self._unanswered or sent_later)

    def uplink(self, now: int) -> Uplink:
        """Delay and loss on the link to the vehicle at the time `now`."""
        oldest = now - _WINDOW_S / _S_PER_NS
        trips = [trip for received, trip in self._round_trips if received >= oldest]
        shortest = _S_PER_NS * min(trips) if len(trips) >= _MIN_ANSWERS else None
        return Uplink(shortest, self._unanswered)
