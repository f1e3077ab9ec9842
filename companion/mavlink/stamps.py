"""Which signature time stamps are believed, and which date we assume.

Source: the MAVLink message-signing guide, "Timestamp handling": stamps of a stream must rise, a new
stream may be a minute behind, the newest stamp is kept on disk, and it starts at the later of clock
and disk. The guide believes every stamp with a right key; here the future is bounded.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum
from threading import Event

EPOCH_UNIX_S = 1420070400
"""Stamps count 10 us since 2015-01-01 UTC."""
TICKS_PER_S = 100_000
_DAY = 86_400 * TICKS_PER_S
_MINUTE = 60 * TICKS_PER_S
_PROGRAM_DATE = (1_788_220_800 - EPOCH_UNIX_S) * TICKS_PER_S
"""2026-09-01. A right clock never says less; raise it with a release."""
_FURTHEST = 5 * 365 * _DAY

MOST_TICKS = 2**48 - 2 * _FURTHEST
"""Our date is never later (2094), so no stamp exceeds its 48 bits."""

Stream = tuple[int, int, int]
"""System, component and link id."""

SET_CLOCK = "set this computer's clock (NTP, or by hand)"


class SignatureResult(Enum):
    """Result of checking a frame's signature and its time stamp."""

    GOOD = "signed with our key, and newer than all before it on its stream"
    UNSIGNED = "not signed"
    WRONG_KEY = "signed with another key"
    REPLAYED = "not newer than what came before: repeated on the way, or a recording"
    AHEAD = "signed with our key, but dated further in the future than is believed"


@dataclass(frozen=True)
class Stamps:
    """The stamps kept from one run of the program to the next, in ticks of 10 us.

    Attributes:
        date: Our own date at the end.
        sent: The newest stamp that we used.
        streams: The newest stamps accepted of each stream: one in our own time, and one of a date
            that only the vehicle gave.
    """

    date: int = 0
    sent: int = 0
    streams: dict[Stream, tuple[int, ...]] = field(default_factory=dict)


class StampJudge:
    """Judges the time stamps of signatures whose key is right.

    Our date is the computer's clock at the start, or what is kept on disk, or the program's own
    date, whichever is latest. From then on it goes with the monotonic clock: no NTP step in flight
    makes a good stamp bad.

    - Up to a day ahead of our date: must be newer than all before it on its stream, on disk too; a
      stream not heard in this run may be a minute behind.
    - Up to 5 years ahead: the computer's clock may be behind (no battery), or it is a recording, or
      somebody's clock is wrong. Refused until the signer has answered a TIMESYNC question that we
      asked in this run: no recording can do that. Kept apart from the others, so it never makes
      stamps of our own time look old.
    - Further ahead: refused, and nothing follows from it.

    Args:
        kept: From the last run.
        clock: Unix time in s, read once.
        elapsed: Monotonic time in s.

    Attributes:
        remarks: Sentences for the user; the reader removes them.
        changed: Set at the first frame of a stream in this run.
    """

    def __init__(
        self,
        kept: Stamps,
        clock: Callable[[], float] = time.time,
        elapsed: Callable[[], float] = time.monotonic,
    ) -> None:
        self.remarks: list[str] = []
        self.changed = Event()
        self._said: set[str] = set()
        self._elapsed = elapsed
        start = int((clock() - EPOCH_UNIX_S) * TICKS_PER_S)
        self._doubt_clock(start, kept.date)
        self._start = min(max(start, kept.date, _PROGRAM_DATE), MOST_TICKS)
        self._started = elapsed()
        self._limit = self._start + _DAY
        self._kept = kept.streams
        self._heard: dict[tuple[Stream, bool], int] = {}
        self._newest = {False: 0, True: 0}
        self._answered = False

    def date(self) -> int:
        """Our date now, ticks."""
        return self._start + int((self._elapsed() - self._started) * TICKS_PER_S)

    def awaits_answer(self, stamp: int) -> bool:
        """Whether `stamp` would be believed if it answered a TIMESYNC request of ours."""
        date = self.date()
        in_reach = date + _DAY < stamp <= date + _FURTHEST
        # Once a signer in our own time was heard, no other changes our date.
        return in_reach and not self._answered and not self._newest[False]

    def judge(self, stream: Stream, stamp: int, *, answers: bool) -> SignatureResult:
        """Judge a stamp; only a good one is remembered.

        Args:
            stream: The signer's stream.
            stamp: Ticks.
            answers: Whether the frame answers a question that we asked in this run.
        """
        date = self.date()
        ahead = stamp > date + _DAY
        if stamp > date + _FURTHEST:
            self._remark_ahead(stamp - date, f"and not believed; {SET_CLOCK}, or the vehicle's")
            return SignatureResult.AHEAD
        if stamp <= self._oldest(stream, ahead, date):
            if date - stamp > _MINUTE and not self._newest[ahead]:
                self._remark(
                    f"signatures are dated {_days(date - stamp)} before our date, and refused; "
                    "that is a recording, or the vehicle lacks its date (GPS), or this computer's "
                    "clock is ahead"
                )
            return SignatureResult.REPLAYED
        if ahead and not self._answered:
            if not answers:
                self._remark_ahead(
                    stamp - date,
                    f"and refused until the vehicle answers a question of ours; {SET_CLOCK}",
                )
                return SignatureResult.AHEAD
            self._answered = True
            self._remark(
                f"this computer's clock is not to be trusted: it is {_days(stamp - date)} behind "
                f"the vehicle, which has our key and answers us, so its date is taken; {SET_CLOCK}"
            )
        if (stream, ahead) not in self._heard:
            self.changed.set()
        self._heard[stream, ahead] = stamp
        self._newest[ahead] = max(self._newest[ahead], stamp)
        return SignatureResult.GOOD

    def streams(self) -> dict[Stream, tuple[int, ...]]:
        """The newest stamps of each stream heard in this run."""
        heard = dict(self._heard)  # a copy: another thread calls this
        newest = {}
        for stream in {stream for stream, _ in heard}:
            floors = (
                heard.get((stream, ahead), self._floor(stream, ahead)) for ahead in (False, True)
            )
            newest[stream] = tuple(floor for floor in floors if floor)
        return newest

    def _oldest(self, stream: Stream, ahead: bool, date: int) -> int:
        """Lower bound: the next stamp must be newer than this."""
        heard = self._heard.get((stream, ahead))
        if heard is not None:
            return heard
        newest = self._newest[ahead] if ahead else max(self._newest[ahead], date)
        return max(self._floor(stream, ahead), newest - _MINUTE)

    def _floor(self, stream: Stream, ahead: bool) -> int:
        """The newest stamp on disk of that stream, in our own time or ahead of it."""
        stamps = (s for s in self._kept.get(stream, ()) if (s > self._limit) == ahead)
        return max(stamps, default=0)

    def _doubt_clock(self, start: int, kept: int) -> None:
        if start < kept - _MINUTE and kept > _PROGRAM_DATE:
            self._remark(
                f"this computer's clock is not to be trusted: it says {_date(start)}, but "
                f"{_date(kept)} has passed, and counts; {SET_CLOCK}; if it was ahead before, "
                "delete the file of time stamps (docs/signing.md)"
            )
        elif start < _PROGRAM_DATE:
            self._remark(
                f"this computer's clock is not to be trusted: it says {_date(start)}, before this "
                f"program was made, so {_date(_PROGRAM_DATE)} counts; {SET_CLOCK}"
            )

    def _remark_ahead(self, ticks: int, what: str) -> None:
        self._remark(f"signatures are dated {_days(ticks)} ahead of our date, {what}")

    def _remark(self, text: str) -> None:
        if text not in self._said:
            self._said.add(text)
            self.remarks.append(text)


def _days(ticks: int) -> str:
    days = ticks / _DAY
    return f"{24.0 * days:.1f} hours" if days < 2.0 else f"{days:.0f} days"


def _date(ticks: int) -> str:
    return time.strftime("%Y-%m-%d %H:%M UTC", time.gmtime(EPOCH_UNIX_S + ticks // TICKS_PER_S))
