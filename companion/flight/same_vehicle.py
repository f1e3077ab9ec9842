"""Whether the vehicle at the other end still is the one that was checked."""

from collections.abc import Callable

from companion.preflight.evidence import Identity
from companion.safety.ending import Exit, FlightEnded
from companion.vehicle.link import Link

LONGEST_SILENCE = 2.0
"""A vehicle that is there sends something within this time, s, on the worst link that is flown."""
_LOOK = 0.1
"""Silence is counted while we listen: a look that comes later than this, s, was our own stall."""


class ChecksVoid(FlightEnded):
    """What was checked may be another vehicle; nothing was armed, so it can be checked anew."""


class SameVehicle:
    """Notices whatever may have put another vehicle, or a restarted one, in the place of ours.

    System and component ids say little: two vehicles may have the same. So a new peer on the link,
    a clock that started anew, another hardware id, and a silence longer than a vehicle keeps each
    mean: what was checked does not count any more.

    Args:
        link: to the vehicle.
        clock: ours, s.
    """

    def __init__(self, link: Link, clock: Callable[[], float]) -> None:
        self._link, self._clock = link, clock
        self._begun = self._committed = False
        self._peers = self._restarts = 0
        self._uid: str | None = None
        self._other_uid: str | None = None
        self._frames = 0
        self._looked_at = clock()
        self._silent_for = self._silence = 0.0

    def begin(self) -> None:
        """What is heard from now on is to be one vehicle's."""
        self._begun, self._committed = True, False
        self._uid = self._other_uid = None
        self._peers, self._restarts = self._link.stats.peers, self._link.clock.restarts
        self._frames, self._looked_at = self._link.stats.frames, self._clock()
        self._silent_for = self._silence = 0.0

    def commit(self) -> None:
        """From now on the vehicle is armed or flies: another one in its place ends the flight.

        Silence is then the watch's matter, which knows of takeovers.
        """
        self._committed, self._silence = True, 0.0

    def look(self) -> None:
        """Count for how long nothing was heard; called 50 times a second."""
        now, frames = self._clock(), self._link.stats.frames
        since, self._looked_at = now - self._looked_at, now
        if frames == self._frames:
            self._silent_for += min(since, _LOOK)
            return
        if self._silent_for > LONGEST_SILENCE and not self._committed:
            self._silence = self._silent_for
        self._frames, self._silent_for = frames, 0.0

    def note_identity(self, identity: Identity) -> None:
        """AUTOPILOT_VERSION came; an unknown hardware id says nothing."""
        if self._uid is None:
            self._uid = identity.uid
        elif identity.uid not in (None, self._uid):
            self._other_uid = identity.uid

    @property
    def same(self) -> bool:
        """Whether nothing speaks against it; asked at every sample."""
        return (
            self._peers == self._link.stats.peers
            and self._restarts == self._link.clock.restarts
            and self._other_uid is None
            and not self._silence
            and (self._silent_for <= LONGEST_SILENCE or self._committed)
        ) or not self._begun

    def require(self) -> None:
        """See that it is the same vehicle.

        Raises:
            ChecksVoid: it may be another one, and nothing was armed yet.
            FlightEnded: it may be another one; the vehicle is let go.
        """
        if self.same or (reason := self._reason()) is None:
            return
        if self._committed:
            raise FlightEnded(reason, Exit.RELEASE)
        raise ChecksVoid(reason)

    def _reason(self) -> str | None:
        """What speaks against it; None while it only is silent, and may come back as it was."""
        if self._peers != self._link.stats.peers:
            return "the vehicle is heard from another address or connection than before"
        if self._restarts != self._link.clock.restarts:
            return f"the autopilot may have restarted: {self._link.clock.last_change}"
        if self._other_uid is not None:
            return f"another vehicle answers: hardware id {self._other_uid}, not {self._uid}"
        if self._silence:
            return f"the vehicle was not heard for {self._silence:.1f} s"
        return None
