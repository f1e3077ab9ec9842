"""Decides which signature time stamps are accepted, and which date this program assumes.

Source: the MAVLink message-signing guide, "Timestamp handling". The stamps of a stream must rise.
The first stamp of a new stream may be a minute older than the newest stamp of the others. The
newest stamp is kept on disk, and the next run starts at this stamp or at the computer's clock,
whichever is later. The guide accepts every stamp with the right key; here, stamps too far in the
future are refused.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum
from threading import Event

EPOCH_UNIX_S = 1420070400
"""2015-01-01 UTC as Unix time, s; time stamps count 10 us since then."""
TICKS_PER_S = 100_000
_DAY_TICKS = 86_400 * TICKS_PER_S
_MINUTE_TICKS = 60 * TICKS_PER_S
_RELEASE_DATE = (1_788_220_800 - EPOCH_UNIX_S) * TICKS_PER_S
"""2026-09-01, ticks. A correct clock is never earlier; raise this date with a release."""
_MAX_LEAD = 5 * 365 * _DAY_TICKS
"""Largest time by which an accepted stamp may be ahead of the date, ticks."""

LATEST_TICKS = 2**48 - 2 * _MAX_LEAD
"""Latest date that is used (2094), ticks, so that every stamp fits into 48 bits."""

SignatureStream = tuple[int, int, int]
"""System, component and link id."""

SET_CLOCK = "set this computer's clock (NTP, or by hand)"


class SignatureResult(Enum):
    """Result of checking a frame's signature and its time stamp."""

    GOOD = "signed with the configured key, and newer than all before it on its stream"
    UNSIGNED = "not signed"
    WRONG_KEY = "signed with another key"
    REPLAYED = "not newer than an earlier frame, or too old: repeated by the link, or a recording"
    DATED_TOO_FAR_AHEAD = "signed with the configured key, but dated too far in the future"


@dataclass(frozen=True)
class Stamps:
    """The stamps kept from one run of the program to the next, in ticks of 10 us."""

    program_date: int = 0
    """This program's date when the stamps were written."""
    newest_sent: int = 0
    streams: dict[SignatureStream, tuple[int, ...]] = field(default_factory=dict)
    """The newest stamps accepted on each stream: one near this program's date, and one far ahead of
    it, if the vehicle proved that date (see `StampChecker`)."""


class StampChecker:
    """Judges the time stamps of signatures made with the right key.

    The date of this program is the latest of three: the computer's clock at the start, the date
    kept on disk, and the date of the release. From then on it follows the monotonic clock, so that
    good stamps stay good when NTP sets the computer's clock in flight.

    - A stamp up to a day ahead of the date must be newer than all before it on its stream,
      including those on disk. On a stream not yet heard in this run it must also be less than a
      minute older than the date, and than the newest stamp of the other streams.
    - A stamp up to 5 years ahead may have three causes: this computer's clock is behind (no
      battery), the frame is a recording, or the vehicle's clock is wrong. The stamp is refused
      until the vehicle has answered a TIMESYNC request of this run, which no recording can do.
      Stamps far ahead are kept apart, so that they do not make stamps near the date look old.
    - A stamp further ahead is refused.

    Args:
        clock: returns Unix time in s; called once.
        monotonic_clock: returns monotonic time in s.

    Attributes:
        remarks: sentences for the user; the code that shows them removes them.
        write_requested: set at the first frame of a stream in this run.
    """

    def __init__(
        self,
        stored_stamps: Stamps,
        clock: Callable[[], float],
        monotonic_clock: Callable[[], float],
    ) -> None:
        self.remarks: list[str] = []
        self.write_requested = Event()
        self._remarked: set[str] = set()
        self._monotonic_clock = monotonic_clock
        clock_date = int((clock() - EPOCH_UNIX_S) * TICKS_PER_S)
        self._check_clock(clock_date, stored_stamps.program_date)
        self._start_date = min(
            max(clock_date, stored_stamps.program_date, _RELEASE_DATE), LATEST_TICKS
        )
        self._start_monotonic = monotonic_clock()
        self._far_ahead_limit = self._start_date + _DAY_TICKS
        self._stored_streams = stored_stamps.streams
        # The newest stamps of all streams. True: of stamps far ahead of the date; False: of others.
        self._newest = {False: 0, True: 0}
        self._newest_by_stream: dict[tuple[SignatureStream, bool], int] = {}
        self._is_vehicle_date_proven = False

    def program_date(self) -> int:
        """The date of this program now, ticks."""
        return self._start_date + int(
            (self._monotonic_clock() - self._start_monotonic) * TICKS_PER_S
        )

    def timesync_answer_would_prove(self, stamp: int) -> bool:
        """Whether `stamp` would be accepted if its frame answered a TIMESYNC request."""
        date = self.program_date()
        is_far_ahead = date + _DAY_TICKS < stamp <= date + _MAX_LEAD
        # Once a stamp near the date was accepted, no other stamp changes the date.
        return is_far_ahead and not self._is_vehicle_date_proven and not self._newest[False]

    def check(
        self, stream: SignatureStream, stamp: int, *, answers_timesync: bool
    ) -> SignatureResult:
        """Judge a stamp; only a good one is remembered.

        Args:
            stream: the signer's stream.
            stamp: the time stamp, ticks.
            answers_timesync: whether the frame answers a TIMESYNC request of this run.
        """
        date = self.program_date()
        is_far_ahead = stamp > date + _DAY_TICKS
        if stamp > date + _MAX_LEAD:
            self._remark_dated_ahead(stamp - date, f"and refused; {SET_CLOCK}, or the vehicle's")
            return SignatureResult.DATED_TOO_FAR_AHEAD
        if stamp <= self._lower_bound(stream, is_far_ahead, date):
            if date - stamp > _MINUTE_TICKS and not self._newest[is_far_ahead]:
                self._remark(
                    f"the vehicle's signatures are dated {_days_text(date - stamp)} before this "
                    "computer's date, and refused; this is a recording, or the vehicle has no date "
                    f"yet (GPS), or this computer's clock is ahead: {SET_CLOCK}"
                )
            return SignatureResult.REPLAYED
        if is_far_ahead and not self._is_vehicle_date_proven:
            if not answers_timesync:
                self._remark_dated_ahead(
                    stamp - date,
                    f"and refused until the vehicle answers a TIMESYNC request; {SET_CLOCK}",
                )
                return SignatureResult.DATED_TOO_FAR_AHEAD
            self._is_vehicle_date_proven = True
            self._remark(
                f"this computer's clock is wrong: it is {_days_text(stamp - date)} behind the "
                "vehicle, which has the right key and answers, so its date is used; "
                f"{SET_CLOCK}"
            )
        if (stream, is_far_ahead) not in self._newest_by_stream:
            self.write_requested.set()
        self._newest_by_stream[stream, is_far_ahead] = stamp
        self._newest[is_far_ahead] = max(self._newest[is_far_ahead], stamp)
        return SignatureResult.GOOD

    def streams(self) -> dict[SignatureStream, tuple[int, ...]]:
        """The newest stamps of each stream that was heard in this run; see `Stamps.streams`."""
        newest_by_stream = dict(self._newest_by_stream)  # a copy: another thread calls this
        newest_stamps = {}
        for stream in {stream for stream, _ in newest_by_stream}:
            stamps = (
                newest_by_stream.get(
                    (stream, is_far_ahead), self._stored_stamp(stream, is_far_ahead)
                )
                for is_far_ahead in (False, True)
            )
            newest_stamps[stream] = tuple(stamp for stamp in stamps if stamp)
        return newest_stamps

    def _lower_bound(self, stream: SignatureStream, is_far_ahead: bool, date: int) -> int:
        """Lower bound of the next stamp of this stream, exclusive, ticks."""
        newest_by_stream = self._newest_by_stream.get((stream, is_far_ahead))
        if newest_by_stream is not None:
            return newest_by_stream
        newest = (
            self._newest[is_far_ahead] if is_far_ahead else max(self._newest[is_far_ahead], date)
        )
        return max(self._stored_stamp(stream, is_far_ahead), newest - _MINUTE_TICKS)

    def _stored_stamp(self, stream: SignatureStream, is_far_ahead: bool) -> int:
        """The newest stamp of a stream on disk, ticks; 0 without one.

        `is_far_ahead`: True: only stamps far ahead of the date count; False: only the other stamps.
        """
        stamps = (
            s
            for s in self._stored_streams.get(stream, ())
            if (s > self._far_ahead_limit) == is_far_ahead
        )
        return max(stamps, default=0)

    def _check_clock(self, clock_date: int, stored_date: int) -> None:
        """Add a remark if the clock's date (ticks) is before that on disk or of the release."""
        if clock_date < stored_date - _MINUTE_TICKS and stored_date > _RELEASE_DATE:
            self._remark(
                f"this computer's clock is wrong: it says {_date_text(clock_date)}, but an earlier "
                f"run ended at {_date_text(stored_date)}, so the later date is used; {SET_CLOCK}; "
                "if the clock was ahead in the earlier run, delete the file of time stamps "
                "(docs/signing.md)"
            )
        elif clock_date < _RELEASE_DATE:
            self._remark(
                f"this computer's clock is wrong: it says {_date_text(clock_date)}, before this "
                f"program was released, so {_date_text(_RELEASE_DATE)} is used; {SET_CLOCK}"
            )

    def _remark_dated_ahead(self, ticks: int, advice: str) -> None:
        days = _days_text(ticks)
        self._remark(
            f"the vehicle's signatures are dated {days} ahead of this computer's date, {advice}"
        )

    def _remark(self, text: str) -> None:
        if text not in self._remarked:
            self._remarked.add(text)
            self.remarks.append(text)


def _days_text(ticks: int) -> str:
    days = ticks / _DAY_TICKS
    return f"{24.0 * days:.1f} hours" if days < 2.0 else f"{days:.0f} days"


def _date_text(ticks: int) -> str:
    return time.strftime("%Y-%m-%d %H:%M UTC", time.gmtime(EPOCH_UNIX_S + ticks // TICKS_PER_S))
