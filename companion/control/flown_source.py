"""What guidance flies now: nothing, a held pose, or a source of references."""

from math import dist, inf
from typing import NamedTuple

from companion.control.predictive import FollowedTrajectory
from companion.guidance import Pose, Reference, VehicleMotion
from companion.guidance.braking import Braking, BrakingUpwind
from companion.guidance.follow import Follow
from companion.guidance.reference import ReferenceAt
from companion.guidance.source import ManeuverSource, Source

_REJOINED_DISTANCE = 1.0
"""Distance from the reference at which the vehicle has returned to it after open loop, m."""
_RETURN_TIME = 10.0
"""Time allowed to return to the reference after open loop, s; a return over 10 m takes 4 s."""


class FlownPart(NamedTuple):
    """The maneuver that is flown now, or the source that another program commands."""

    name: str
    """Name to show to the user."""
    elapsed: float
    """Time since the maneuver or source began, s."""
    duration: float | None
    """Duration of the maneuver, s; None: a source, which decides itself when it ends."""
    part: object
    """The maneuver or the source itself."""


class FlownSource:
    """The held pose, and the source that is flown from it.

    Attributes:
        pose: the held pose, or the pose from which the source began; None: neither.
        source: the source of references, or None.
        begun_at: when the source began, s of event-loop time, or None.
        braking: the braking by which the vehicle came, or comes, to rest at the held pose; None:
            the vehicle did not brake for this pose, or no pose is held.
    """

    def __init__(self) -> None:
        self.pose: Pose | None = None
        self.source: Source | None = None
        self.begun_at: float | None = None
        self.braking: Braking | BrakingUpwind | None = None
        self._returning_since: float | None = None  # s; inf: still in open loop

    def clear(self) -> None:
        """Fly no source and hold no pose."""
        self.pose, self.source, self.begun_at, self.braking = None, None, None, None

    def hold(self, braking: Braking | BrakingUpwind) -> None:
        """Brake, and hold the pose where the vehicle stops."""
        self.clear()
        self.pose, self.braking = Pose(braking.stopping_point, braking.heading), braking

    def begin(self, source: Source, pose: Pose, now: float) -> None:
        """Fly `source` from `pose`; `now` is event-loop time, s."""
        source.begin(now, pose)
        self.pose, self.source, self.begun_at, self.braking = pose, source, now, None

    def remaining_braking_time(self, now: float) -> float:
        """Time until the vehicle has come to rest for a hold, s; `now` is event-loop time, s."""
        return 0.0 if self.braking is None else max(0.0, self.braking.end_time - now)

    def finished(self, now: float) -> bool:
        """Whether there is a source and it has reached its end."""
        return self.source is not None and self.source.finished(now)

    def reference(self, now: float, motion: VehicleMotion, heading: float) -> ReferenceAt:
        """Return the reference as a function of event-loop time (s).

        The reference comes from the source; without a source, from the braking; without braking,
        from the held pose; without a pose, from the present position and heading.

        Args:
            now: event-loop time, s.
            motion: present motion of the vehicle.
            heading: present heading of the vehicle, rad.
        """
        pose, source = self.pose, self.source
        if source is not None:
            return source.reference(now, motion)
        if self.braking is not None:
            return self.braking.at
        held_reference = (
            Reference(motion.position_ned, heading=heading)
            if pose is None
            else Reference(pose.position_ned, heading=pose.heading)
        )
        return lambda _: held_reference

    def part(self, now: float) -> FlownPart | None:
        """The maneuver or other source that is flown at `now`, s of loop time; None: nothing is."""
        source, begun_at = self.source, self.begun_at
        if source is None or begun_at is None or source.finished(now):
            return None
        if not isinstance(source, ManeuverSource):
            return FlownPart(source.name, now - begun_at, None, source)
        maneuver, elapsed = source.maneuvers.maneuver_at(now - begun_at)
        return FlownPart(maneuver.name, elapsed, maneuver.duration, maneuver)

    def followed_trajectory(self, now: float) -> FollowedTrajectory | None:
        """The trajectory that is followed at `now`, s of event-loop time; None if none is."""
        source = self.source
        if not isinstance(source, ManeuverSource) or source.begun_at is None or self.pose is None:
            return None
        maneuver, elapsed = source.maneuvers.maneuver_at(now - source.begun_at)
        if not isinstance(maneuver, Follow):
            return None
        return FollowedTrajectory(maneuver, elapsed, self.pose)

    def source_commanding_rates(self, now: float, motion: VehicleMotion) -> str | None:
        """Name of the source if it commands body rates in open loop at `now`; else None."""
        if self.source is None:
            return None
        reference = self.source.reference(now, motion)(now)
        return None if reference.body_rates is None else self.source.name

    def tracking_error(
        self, now: float, reference: Reference, motion: VehicleMotion
    ) -> float | None:
        """Distance from the reference, m; `now` is event-loop time, s.

        None without a pose, and in open loop (the reference does not hold the position). After open
        loop the result stays None until the vehicle has returned to its reference, for at most
        `_RETURN_TIME`. Open loop that begins before the return does not restart this time.
        """
        distance = dist(reference.position_ned, motion.position_ned)
        returning_since = self._returning_since
        if not reference.holds_position:
            self._returning_since = inf if returning_since is None else returning_since
            return None
        if returning_since is not None:
            self._returning_since = returning_since = min(now, returning_since)
            if distance <= _REJOINED_DISTANCE:
                self._returning_since = None
            elif now - returning_since <= _RETURN_TIME:
                return None
        return None if self.pose is None else distance
