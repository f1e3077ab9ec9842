"""Whether the vehicle at the other end still is the one that was checked."""

from companion.doctor.evidence import Identity
from companion.flight.ending import Exit, FlightEnded
from companion.mavlink.link import Link


class ChecksVoid(FlightEnded):
    """What was checked may be another vehicle; nothing was armed, so it can be checked anew."""


class SameVehicle:
    """Notices whatever may have put another vehicle, or a restarted one, in the place of ours.

    System and component ids say little: two vehicles may have the same. So a new peer on the link,
    a clock that started anew, another hardware id, and a pause in the heartbeats longer than a
    vehicle makes each mean: what was checked does not count any more.

    Attributes:
        heartbeat_limit: longest pause between two heartbeats of one vehicle, s.

    Args:
        link: to the vehicle.
        heartbeat_limit: until the checks tell a better one.
    """

    def __init__(self, link: Link, heartbeat_limit: float) -> None:
        self.heartbeat_limit = heartbeat_limit
        self._link = link
        self._begun = self._committed = False
        self._peers = self._restarts = 0
        self._uid: str | None = None
        self._other_uid: str | None = None
        self._heard_at: float | None = None
        self._pause: float | None = None

    def begin(self) -> None:
        """What is heard from now on is to be one vehicle's."""
        self._begun, self._committed = True, False
        self._uid = self._other_uid = self._pause = None
        self._peers, self._restarts = self._link.stats.peers, self._link.clock.restarts

    def commit(self) -> None:
        """From now on the vehicle is armed or flies: another one in its place ends the flight.

        Pauses of the heartbeat are then the watch's matter, which knows of takeovers.
        """
        self._committed, self._pause = True, None

    def note_heartbeat(self) -> None:
        """A heartbeat came; one that is not the autopilot's changes nothing."""
        heartbeat = self._link.state.heartbeat
        if heartbeat is None:
            return
        before, self._heard_at = self._heard_at, heartbeat.received
        pause = 0.0 if before is None else heartbeat.received - before
        if pause > self.heartbeat_limit and self._begun and not self._committed:
            self._pause = pause

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
            and self._pause is None
        ) or not self._begun

    def require(self) -> None:
        """See that it is the same vehicle.

        Raises:
            ChecksVoid: it may be another one, and nothing was armed yet.
            FlightEnded: it may be another one; the vehicle is let go.
        """
        if self.same:
            return
        if self._committed:
            raise FlightEnded(self._reason(), Exit.LET_GO)
        raise ChecksVoid(self._reason())

    def _reason(self) -> str:
        if self._peers != self._link.stats.peers:
            return "the vehicle is heard from another address or connection than before"
        if self._restarts != self._link.clock.restarts:
            return f"the autopilot may have restarted: {self._link.clock.last_change}"
        if self._other_uid is not None:
            return f"another vehicle answers: hardware id {self._other_uid}, not {self._uid}"
        return f"the vehicle was not heard for {self._pause:.1f} s"
