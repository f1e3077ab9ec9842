"""What guidance flies now: no reference, a held pose, or maneuvers that began at a known time."""

from collections.abc import Callable
from math import dist, nan

from companion.control.predictive import Following
from companion.guidance import Maneuver, ManeuverSequence, Pose, Reference, VehicleMotion
from companion.guidance.follow import Follow
from companion.guidance.linear import ReferenceAt
from companion.recording.trace import FlightTrace

_REJOINED = 1.0
"""Closer than this to its reference, a vehicle is back from open-loop commands, m."""


class FlownManeuver:
    """The held pose and the maneuvers flown from it.

    Attributes:
        pose: the held pose, or the one from which the maneuvers began; None: no reference.
        maneuvers: those being flown, or None.
        begun_at: when the maneuvers began, s on our clock, or None.
        note: takes a message for each maneuver that begins.
    """

    def __init__(self) -> None:
        self.pose: Pose | None = None
        self.maneuvers: ManeuverSequence | None = None
        self.begun_at: float | None = None
        self.note: Callable[[str], None] = lambda _: None
        self._off_reference = False
        self._recorded: Maneuver | None = None

    def clear(self) -> None:
        """Fly no maneuver and hold no pose."""
        self.pose, self.maneuvers, self.begun_at = None, None, None

    def begin(self, maneuvers: ManeuverSequence, now: float) -> None:
        """Fly `maneuvers` from the held pose; `now` in s on our clock."""
        self.maneuvers, self.begun_at = maneuvers, now

    def finished(self, now: float) -> bool:
        """Whether the maneuvers have ended."""
        if self.maneuvers is None or self.begun_at is None:
            return False
        return now - self.begun_at >= self.maneuvers.duration

    def part(self, now: float) -> tuple[Maneuver, float] | None:
        """The maneuver that is flown at `now` (s on our clock), and for how long it has been, s."""
        if self.maneuvers is None or self.begun_at is None or self.finished(now):
            return None
        return self.maneuvers.part_at(now - self.begun_at)

    def reference(self, motion: VehicleMotion, heading: float) -> ReferenceAt:
        """The reference as a function of our clock; without a pose, where the vehicle is.

        Args:
            motion: of the vehicle now.
            heading: of the vehicle now, rad.
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
            now: s on our clock.
            turn: sum of the heading resets, rad.
        """
        if self.maneuvers is None or self.begun_at is None or self.pose is None:
            return None
        part, elapsed = self.maneuvers.part_at(now - self.begun_at)
        if not isinstance(part, Follow):
            return None
        return Following(part, elapsed, self.pose, turn)

    def steers_by_rates(self, now: float) -> str | None:
        """The maneuvers' name while they command body rates in open loop, or None."""
        if self.pose is None or self.maneuvers is None or self.begun_at is None:
            return None
        reference = self.maneuvers.at(now - self.begun_at, self.pose)
        return None if reference.body_rates is None else self.maneuvers.name

    def tracking_error(self, reference: Reference, motion: VehicleMotion) -> float | None:
        """Distance from the reference, m.

        None without a pose, in open loop, and on the way back from open loop.
        """
        distance = dist(reference.position_ned, motion.position_ned)
        returning = self._off_reference and distance > _REJOINED
        self._off_reference = not reference.position_is_meant or returning
        return None if self.pose is None or self._off_reference else distance

    def record(
        self,
        trace: FlightTrace,
        now: float,
        vehicle_time: float,
        reference: Reference,
        motion: VehicleMotion,
    ) -> None:
        """Record reference and measured position, and which maneuver begins or ended.

        Args:
            trace: takes the record.
            now: s on our clock.
            vehicle_time: s.
            reference: at that time.
            motion: of the vehicle at that time.
        """
        flown = self.part(now)
        maneuver = None if flown is None else flown[0]
        if maneuver is not self._recorded:
            self._recorded = maneuver
            trace.begin_maneuver(now, vehicle_time, None if maneuver is None else maneuver.name)
            if maneuver is not None:
                self.note(f"maneuver: {maneuver.name}")
        north, east, down = reference.position_ned
        if not reference.position_is_meant:
            north = east = nan  # only the height is a reference in open loop
        trace.add_tracking(vehicle_time, (north, east, down), motion.position_ned)
