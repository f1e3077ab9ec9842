"""What guidance flies now: no reference, a held pose, or a source of references."""

from math import dist

from companion.control.predictive import Following
from companion.guidance import Pose, Reference, VehicleMotion
from companion.guidance.follow import Follow
from companion.guidance.reference import ReferenceAt
from companion.guidance.source import ManeuverSource, Source

_REJOINED = 1.0
"""Closer than this to its reference, a vehicle is back from open-loop commands, m."""


class FlownSource:
    """The held pose, and the source that is flown from it.

    Attributes:
        pose: the held pose, or the one from which the source began; None: no reference.
        source: of the references, or None.
        begun_at: when the source began, s on our clock, or None.
    """

    def __init__(self) -> None:
        self.pose: Pose | None = None
        self.source: Source | None = None
        self.begun_at: float | None = None
        self._off_reference = False

    def clear(self) -> None:
        """Fly no source and hold no pose."""
        self.pose, self.source, self.begun_at = None, None, None

    def begin(self, source: Source, pose: Pose, now: float) -> None:
        """Fly `source` from `pose`; `now` in s on our clock."""
        source.begin(now, pose)
        self.pose, self.source, self.begun_at = pose, source, now

    def finished(self, now: float) -> bool:
        """Whether the source has no more to fly."""
        return self.source is not None and self.source.finished(now)

    def reference(self, now: float, motion: VehicleMotion, heading: float) -> ReferenceAt:
        """The reference as a function of our clock; without a pose, where the vehicle is.

        Args:
            now: s on our clock.
            motion: of the vehicle now.
            heading: of the vehicle now, rad.
        """
        pose, source = self.pose, self.source
        if source is not None:
            return source.reference(now, motion)
        held = (
            Reference(motion.position_ned, heading=heading)
            if pose is None
            else Reference(pose.position_ned, heading=pose.heading)
        )
        return lambda _: held

    def following(self, now: float, turn: float) -> Following | None:
        """The trajectory that is followed now, or None.

        Args:
            now: s on our clock.
            turn: sum of the heading resets, rad.
        """
        source = self.source
        if not isinstance(source, ManeuverSource) or source.begun_at is None or self.pose is None:
            return None
        part, elapsed = source.maneuvers.part_at(now - source.begun_at)
        if not isinstance(part, Follow):
            return None
        return Following(part, elapsed, self.pose, turn)

    def steers_by_rates(self, now: float, motion: VehicleMotion) -> str | None:
        """The source's name while it commands body rates in open loop, or None."""
        if self.source is None:
            return None
        reference = self.source.reference(now, motion)(now)
        return None if reference.body_rates is None else self.source.name

    def tracking_error(self, reference: Reference, motion: VehicleMotion) -> float | None:
        """Distance from the reference, m.

        None without a pose, in open loop, and on the way back from open loop.
        """
        distance = dist(reference.position_ned, motion.position_ned)
        returning = self._off_reference and distance > _REJOINED
        self._off_reference = not reference.position_is_meant or returning
        return None if self.pose is None or self._off_reference else distance
