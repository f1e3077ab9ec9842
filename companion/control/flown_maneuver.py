"""What guidance flies now: no reference, a held pose, or maneuvers that began at a known time."""

from math import dist

from companion.control.predictive import Following
from companion.guidance import ManeuverSequence, Pose, Reference, VehicleMotion
from companion.guidance.follow import Follow
from companion.guidance.linear import ReferenceAt

_REJOINED = 1.0
"""After open-loop commands, the vehicle has returned when it is this close to its reference, m."""


class FlownManeuver:
    """The held pose and the maneuvers flown from it.

    Attributes:
        pose: the held pose, or the one from which the maneuvers began; None: no reference.
        maneuvers: the maneuvers that are flown, or None.
        begun_at: when the maneuvers began, s of event-loop time, or None.
    """

    def __init__(self) -> None:
        self.pose: Pose | None = None
        self.maneuvers: ManeuverSequence | None = None
        self.begun_at: float | None = None
        self._off_reference = False

    def clear(self) -> None:
        """Fly no maneuver and hold no pose."""
        self.pose, self.maneuvers, self.begun_at = None, None, None

    def begin(self, maneuvers: ManeuverSequence, now: float) -> None:
        """Fly `maneuvers` from the held pose; `now` in s of event-loop time."""
        self.maneuvers, self.begun_at = maneuvers, now

    def finished(self, now: float) -> bool:
        """Whether the maneuvers have ended."""
        if self.maneuvers is None or self.begun_at is None:
            return False
        return now - self.begun_at >= self.maneuvers.duration

    def reference(self, motion: VehicleMotion, heading: float) -> ReferenceAt:
        """The reference as a function of event-loop time (s); without a pose, the present place.

        Args:
            motion: present motion of the vehicle.
            heading: present heading of the vehicle, rad.
        """
        pose, maneuvers, begun_at = self.pose, self.maneuvers, self.begun_at
        if pose is None:
            here = Reference(motion.position_ned, heading=heading)
            return lambda _: here
        if maneuvers is None or begun_at is None:
            held = Reference(pose.position_ned, heading=pose.heading)
            return lambda _: held
        return lambda time: maneuvers.at(time - begun_at, pose)

    def following(self, now: float, turn: float) -> Following | None:
        """The trajectory that is followed now, or None.

        Args:
            now: s of event-loop time.
            turn: sum of the heading resets, rad.
        """
        if self.maneuvers is None or self.begun_at is None or self.pose is None:
            return None
        part, elapsed = self.maneuvers.part_at(now - self.begun_at)
        if not isinstance(part, Follow):
            return None
        return Following(part, elapsed, self.pose, turn)

    def steers_by_rates(self, now: float) -> str | None:
        """Name of the maneuvers if they command body rates in open loop at `now`; else None."""
        if self.pose is None or self.maneuvers is None or self.begun_at is None:
            return None
        reference = self.maneuvers.at(now - self.begun_at, self.pose)
        return None if reference.body_rates is None else self.maneuvers.name

    def tracking_error(self, reference: Reference, motion: VehicleMotion) -> float | None:
        """Distance from the reference, m.

        It is None without a pose, in open loop, and while the vehicle returns from open loop.
        """
        distance = dist(reference.position_ned, motion.position_ned)
        returning = self._off_reference and distance > _REJOINED
        self._off_reference = not reference.position_is_meant or returning
        return None if self.pose is None or self._off_reference else distance
