"""Sources of guidance: where the reference comes from while the vehicle is under our control."""

from typing import Protocol

from companion.guidance.maneuvers import ManeuverSequence
from companion.guidance.reference import Pose, Reference, ReferenceAt, VehicleMotion


class Source(Protocol):
    """Tells the reference. Maneuvers, another program's setpoints and a coroutine are its kinds.

    Times are s on our clock. Positions are NED in m, in the frame without estimator resets.
    """

    @property
    def name(self) -> str:
        """Shown to the user."""
        ...

    @property
    def failure(self) -> str | None:
        """Why the source has nothing to fly any more although it is not finished, or None."""
        ...

    def begin(self, now: float, pose: Pose) -> None:
        """Start at `now` from `pose`, which the vehicle has held so far."""
        ...

    def reference(self, now: float, motion: VehicleMotion) -> ReferenceAt:
        """The reference as a function of time; guidance asks once in each of its periods.

        Args:
            now: time of this step of guidance.
            motion: of the vehicle at `now`.
        """
        ...

    def finished(self, now: float) -> bool:
        """Whether the source has no more to fly; its last reference holds on."""
        ...


class ManeuverSource:
    """Flies maneuvers, one after the other, from the pose at which it begins.

    Attributes:
        maneuvers: to fly.
        begun_at: when they began, or None.
        pose: where they began, or None.
        failure: None; a maneuver that is given up is held by guidance.
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
            RuntimeError: they have not begun.
        """
        begun_at, pose = self.begun_at, self.pose
        if begun_at is None or pose is None:
            raise RuntimeError("the maneuvers have not begun")
        return lambda time: self.maneuvers.at(time - begun_at, pose)

    def finished(self, now: float) -> bool:
        """Whether the maneuvers have ended."""
        return self.begun_at is not None and now - self.begun_at >= self.maneuvers.duration


class CommandedSource:
    """The newest reference that another program or the user's code gave, while it is fresh.

    Between two of them the reference moves on by its own velocity, acceleration and jerk. Once one
    has become older than `stale`, or the next one comes later than that, the source has failed: the
    vehicle is held where it is, and no later reference is flown.

    Attributes:
        name: who gives the references.
        pose: where the source began, or None before.

    Args:
        name: who gives the references.
        stale: age beyond which a reference is not flown, s.
        begins_within: time allowed for the first reference, s.
    """

    def __init__(self, name: str, stale: float, begins_within: float) -> None:
        self.name = name
        self.pose: Pose | None = None
        self._stale = stale
        self._begins_within = begins_within
        self._held: Reference | None = None
        self._newest: Reference | None = None
        self._given_at = 0.0
        self._jerk = (0.0, 0.0, 0.0)
        self._ended = False
        self._failure: str | None = None

    def begin(self, now: float, pose: Pose) -> None:
        """Hold `pose` until the first reference."""
        self.pose, self._given_at = pose, now

    def give(
        self, reference: Reference, now: float, jerk_ned: tuple[float, float, float] | None = None
    ) -> None:
        """Take a new reference.

        Args:
            reference: at `now`.
            now: s on our clock.
            jerk_ned: rate of the reference's acceleration, m/s³. None: by the difference from the
                reference before.
        """
        before, since = self._newest, now - self._given_at
        self._require_fresh(now)
        if jerk_ned is not None:
            self._jerk = jerk_ned
        elif before is None or since <= 0.0:
            self._jerk = (0.0, 0.0, 0.0)
        else:
            old, new = before.acceleration_ned, reference.acceleration_ned
            self._jerk = (
                (new[0] - old[0]) / since,
                (new[1] - old[1]) / since,
                (new[2] - old[2]) / since,
            )
        self._newest, self._given_at = reference, now

    def end(self) -> None:
        """Give no more references."""
        self._ended = True

    def reference(self, now: float, motion: VehicleMotion) -> ReferenceAt:
        """The newest reference, continued; or a hold where the vehicle is when it is too old."""
        self._require_fresh(now)
        newest, given_at, jerk = self._newest, self._given_at, self._jerk
        if newest is not None and self._failure is None:
            return lambda time: continued(newest, jerk, time - given_at)
        if self._held is None or newest is None:
            self._held = self._hold(motion)
        held = self._held
        return lambda _: held

    def _hold(self, motion: VehicleMotion) -> Reference:
        """Hold where the source began; after references were flown, where the vehicle is."""
        if self._newest is None and self.pose is not None:
            return Reference(self.pose.position_ned, heading=self.pose.heading)
        heading = 0.0 if self._newest is None else self._newest.heading
        return Reference(motion.position_ned, heading=heading)

    def _require_fresh(self, now: float) -> None:
        """Note a failure if the newest reference is too old, or the first one does not come."""
        patience = self._begins_within if self._newest is None else self._stale
        if self._failure is None and not self._ended and now - self._given_at > patience:
            self._failure = f"{self.name} gave no new command for {patience:g} s"

    @property
    def failure(self) -> str | None:
        """Why control must end: told by `fail`, or the references have stopped."""
        return self._failure

    def fail(self, reason: str) -> None:
        """Give no more references, because of `reason`."""
        self._failure = reason

    def finished(self, now: float) -> bool:
        """Whether `end` was called."""
        return self._ended


def continued(
    reference: Reference, jerk_ned: tuple[float, float, float], elapsed: float
) -> Reference:
    """The reference `elapsed` seconds later, at a constant jerk (m/s³) and heading rate."""
    position, velocity, acceleration = (
        reference.position_ned,
        reference.velocity_ned,
        reference.acceleration_ned,
    )
    t, t2, t3 = elapsed, 0.5 * elapsed**2, elapsed**3 / 6.0
    (p0, p1, p2), (v0, v1, v2), (a0, a1, a2), (j0, j1, j2) = (
        position,
        velocity,
        acceleration,
        jerk_ned,
    )
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
