"""Sources of references for guidance: maneuvers, or references given one by one."""

from typing import Protocol

from companion.guidance.maneuvers import ManeuverSequence
from companion.guidance.reference import (
    LARGEST_JERK,
    Pose,
    Reference,
    ReferenceAt,
    Vector,
    VehicleMotion,
    change_rate,
)

_NO_JERK = (0.0, 0.0, 0.0)
_SHORTEST_JERK_TIME = 0.01
"""Shortest time from which the jerk is computed, s: half a period of guidance at 50 Hz."""


class Source(Protocol):
    """Provides references to guidance: from maneuvers, another program, or a user's coroutine.

    Times are event-loop times, s. Positions are m NED, in the frame that the estimator's resets do
    not move.
    """

    @property
    def name(self) -> str:
        """Name to show to the user."""

    @property
    def failure(self) -> str | None:
        """Why the source cannot continue although it has not finished; None: it can continue."""

    def begin(self, now: float, pose: Pose) -> None:
        """Start at `now` from `pose`, which the vehicle holds or at which it is about to stop."""

    def reference(self, now: float, motion: VehicleMotion) -> ReferenceAt:
        """The reference as a function of time; guidance calls this at least once in each period.

        Args:
            now: time of this step of guidance.
            motion: motion of the vehicle at `now`.
        """

    def finished(self, now: float) -> bool:
        """Whether the source has reached its end; `reference` can still be called after it."""


class ManeuverSource:
    """Flies maneuvers, one after the other, from the pose at which it begins.

    Attributes:
        maneuvers: the maneuvers to fly.
        begun_at: when the maneuvers began, s of event-loop time, or None.
        pose: the pose at which the maneuvers began, or None.
        failure: always None; when a maneuver is given up, guidance itself begins a hold.
    """

    failure: str | None = None

    def __init__(self, maneuvers: ManeuverSequence) -> None:
        self.maneuvers = maneuvers
        self.begun_at: float | None = None
        self.pose: Pose | None = None

    @property
    def name(self) -> str:
        """The names of the maneuvers."""
        return self.maneuvers.name

    def begin(self, now: float, pose: Pose) -> None:
        """Begin the first maneuver at `now`, from `pose`."""
        self.begun_at, self.pose = now, pose

    def reference(self, now: float, motion: VehicleMotion) -> ReferenceAt:
        """The reference of the maneuver that is flown at each time.

        Raises:
            RuntimeError: the maneuvers have not begun.
        """
        begun_at, pose = self.begun_at, self.pose
        if begun_at is None or pose is None:
            raise RuntimeError("the maneuvers have not begun")
        return lambda time: self.maneuvers.at(time - begun_at, pose)

    def finished(self, now: float) -> bool:
        """Whether the maneuvers have ended."""
        return self.begun_at is not None and now - self.begun_at >= self.maneuvers.duration


class CommandedSource:
    """References that another program or the user's code gives one by one.

    Until the next reference the source extrapolates the newest one by its velocity, acceleration
    and jerk. If the newest reference becomes older than `max_age`, the source fails: the vehicle
    holds its position, and later references are not flown.

    Args:
        max_age: largest age of a reference that is flown, s.
        first_reference_timeout: time allowed for the first reference, s.

    Attributes:
        name: who gives the references.
        pose: the pose at which the source began, or None.
        failure: why control must end: `fail` was called, or references stopped coming; else None.
    """

    def __init__(self, name: str, max_age: float, first_reference_timeout: float) -> None:
        self.name = name
        self.pose: Pose | None = None
        self._max_age = max_age
        self._first_reference_timeout = first_reference_timeout
        self._hold_reference: Reference | None = None
        self._newest: Reference | None = None
        self._newest_time = 0.0
        self._jerk = _NO_JERK
        self._earlier_reference: Reference | None = None
        self._earlier_time = 0.0
        self._ended = False
        self.failure: str | None = None

    def begin(self, now: float, pose: Pose) -> None:
        """Hold `pose` until the first reference."""
        self.pose, self._newest_time = pose, now

    def give(self, reference: Reference, now: float, jerk_ned: Vector | None = None) -> None:
        """Take a new reference.

        Args:
            reference: the reference at `now`.
            now: event-loop time, s.
            jerk_ned: derivative of the reference's acceleration, m/s³. None: it is computed from
                an earlier reference; 0 for the first reference, after a jump of the acceleration,
                and if the two are commanded in different ways (`_closed_loops`).
        """
        self._check_age(now)
        self._jerk = self._jerk_towards(reference, now) if jerk_ned is None else jerk_ned
        self._newest, self._newest_time = reference, now

    def _jerk_towards(self, reference: Reference, now: float) -> Vector:
        """Jerk from an earlier reference to this one, m/s³; 0 if it cannot be computed.

        If this reference comes less than `_SHORTEST_JERK_TIME` after the earlier one, the last jerk
        is returned.
        """
        earlier_reference, elapsed = self._earlier_reference, now - self._earlier_time
        if earlier_reference is not None and elapsed < _SHORTEST_JERK_TIME:
            return (
                self._jerk
                if _closed_loops(earlier_reference) == _closed_loops(reference)
                else _NO_JERK
            )
        self._earlier_reference, self._earlier_time = reference, now
        if earlier_reference is None or _closed_loops(earlier_reference) != _closed_loops(
            reference
        ):
            return _NO_JERK
        old, new = earlier_reference.acceleration_ned, reference.acceleration_ned
        north, east, down = change_rate(old, new, elapsed, LARGEST_JERK) or _NO_JERK
        return north, east, down

    def end(self) -> None:
        """Note that no more references will come."""
        self._ended = True

    def reference(self, now: float, motion: VehicleMotion) -> ReferenceAt:
        """The newest reference, extrapolated; before the first one, a hold of the initial pose.

        If the newest reference is too old, the present position is held.
        """
        self._check_age(now)
        newest, newest_time, jerk = self._newest, self._newest_time, self._jerk
        if newest is not None and self.failure is None:
            return lambda time: extrapolated_reference(newest, jerk, time - newest_time)
        if self._hold_reference is None or newest is None:
            self._hold_reference = self._hold(motion)
        hold_reference = self._hold_reference
        return lambda _: hold_reference

    def _hold(self, motion: VehicleMotion) -> Reference:
        """Hold the pose where the source began; after references, hold the present position."""
        if self._newest is None and self.pose is not None:
            return Reference(self.pose.position_ned, heading=self.pose.heading)
        heading = 0.0 if self._newest is None else self._newest.heading
        return Reference(motion.position_ned, heading=heading)

    def _check_age(self, now: float) -> None:
        """Note a failure if the newest reference is too old, or the first one is overdue."""
        timeout = self._first_reference_timeout if self._newest is None else self._max_age
        if self.failure is None and not self._ended and now - self._newest_time > timeout:
            self.failure = f"{self.name} gave no new command for {timeout:g} s"

    def fail(self, reason: str) -> None:
        """Note that no more references will come; `reason` is for the user."""
        self.failure = reason

    def finished(self, now: float) -> bool:
        """Whether `end` was called."""
        return self._ended


def _closed_loops(reference: Reference) -> tuple[bool, bool, bool]:
    """Whether a reference closes the horizontal loop, holds the position, and holds the height.

    The accelerations of two references are comparable only if all three are equal.
    """
    return reference.closed_loop, reference.holds_position, reference.holds_height


def extrapolated_reference(reference: Reference, jerk_ned: Vector, elapsed: float) -> Reference:
    """The reference `elapsed` seconds later, at a constant jerk (m/s³) and heading rate."""
    t, t2, t3 = elapsed, 0.5 * elapsed**2, elapsed**3 / 6.0
    p0, p1, p2 = reference.position_ned
    v0, v1, v2 = reference.velocity_ned
    a0, a1, a2 = reference.acceleration_ned
    j0, j1, j2 = jerk_ned
    return reference._replace(
        position_ned=(
            p0 + v0 * t + a0 * t2 + j0 * t3,
            p1 + v1 * t + a1 * t2 + j1 * t3,
            p2 + v2 * t + a2 * t2 + j2 * t3,
        ),
        velocity_ned=(v0 + a0 * t + j0 * t2, v1 + a1 * t + j1 * t2, v2 + a2 * t + j2 * t2),
        acceleration_ned=(a0 + j0 * t, a1 + j1 * t, a2 + j2 * t),
        heading=reference.heading + reference.heading_rate * t,
    )
