"""What guidance knows of the motion: measured positions, carried on by the measured attitude."""

from collections.abc import Callable

from companion.attitude import BodyRates, Quaternion
from companion.attitude.kinematics import tilt_products
from companion.guidance import GRAVITY, DragEstimate, GuidanceInput, MotionObserver, VehicleMotion
from companion.guidance.horizontal import Horizontal
from companion.guidance.position_correction import PositionCorrection
from companion.guidance.slope_history import SlopeHistory
from companion.nmpc import Vehicle
from companion.vehicle.records import AttitudeSample, LocalPosition

_LEAST_COSINE = 0.2
"""Of the tilt; beyond 78° the thrust is not what height hold asked for."""
_LONGEST = 0.2
"""Between two positions, s: further apart they say nothing of what happened between."""
_WORTH_TELLING = 0.15
"""By so much the drag must be off to be told, 1/s."""


class MotionEstimate:
    """Feeds the observer, on the vehicle's clock; and says how the motion goes on.

    Attributes:
        vertical: upward part of the specific thrust that is asked for, m/s².
        drag: its estimate.

    Args:
        observer: of position, velocity and disturbance.
        correction: of the measured positions.
        drag: of the vehicle.
        offset: the vehicle's clock minus ours, s, None before the first attitude: it tells how old
            a position was when it came.
    """

    def __init__(
        self,
        observer: MotionObserver,
        correction: PositionCorrection,
        drag: DragEstimate,
        offset: Callable[[], float | None] = lambda: None,
    ) -> None:
        self.vertical = GRAVITY
        self._observer = observer
        self._correction = correction
        self.drag = drag
        self._offset = offset
        self._slopes = SlopeHistory()
        self._q: Quaternion = (1.0, 0.0, 0.0, 0.0)
        self._body_rates = BodyRates(0.0, 0.0, 0.0)
        self._position: LocalPosition | None = None
        self._turn = 0.0

    def note_attitude(self, sample: AttitudeSample) -> None:
        """Take an attitude; it tells where the thrust points."""
        self._q, self._body_rates = sample.q, sample.body_rates
        square, ax, ay = tilt_products(*sample.q)
        cosine = max(2.0 * square - 1.0, _LEAST_COSINE)
        self._slopes.add(sample.vehicle_time, (-2.0 * ay / cosine, 2.0 * ax / cosine))

    def turn_to(self, turn: float) -> None:
        """The estimate's jumps in heading come to `turn`, rad; attitudes before are not counted."""
        if turn != self._turn:
            self._observer.turn(turn - self._turn)
            self._slopes.forget()
            self._correction.reset()
            self._turn = turn

    def note_position(self, position: LocalPosition, *, offboard_active: bool) -> None:
        """Take a measured position and velocity; the same one twice counts once.

        Drag is learned only while the autopilot obeys, since only then our thrust is known.
        """
        before, self._position = self._position, position
        if before is not None and position.vehicle_time == before.vehicle_time:
            return
        since = position.vehicle_time if before is None else before.vehicle_time
        slope = self._slopes.mean(since, position.vehicle_time)
        measured = self._correction.corrected(
            position.vehicle_time, VehicleMotion(position.position_ned, position.velocity_ned)
        )
        known = self._known(slope, measured)
        self._observer.observe(position.vehicle_time, measured, known)
        if offboard_active and before is not None:
            self._learn_drag(before, position, slope)

    def situation(
        self, now: float, ahead: float, thrust_limits: tuple[float, float]
    ) -> GuidanceInput:
        """The vehicle now (s on our clock), and `ahead` seconds later.

        Args:
            now: s on our clock.
            ahead: s.
            thrust_limits: smallest and largest specific thrust there is, m/s².

        Raises:
            RuntimeError: no position came yet.
        """
        if self._position is None:
            raise RuntimeError("guidance was asked to hold before any position came")
        time = self.vehicle_time(now, self._position)
        still = VehicleMotion(self._position.position_ned, self._position.velocity_ned)
        slope = self._slopes.mean(self._position.vehicle_time, time)
        motion = self._observer.at(time, self._known(slope, still)) or still
        slope = self._slopes.mean(self._position.vehicle_time, time + ahead)
        later = self._observer.at(time + ahead, self._known(slope, motion)) or still
        north, east = self._slopes.newest
        thrust = self.vertical * north, self.vertical * east
        disturbance, drag = self._observer.disturbance, self.drag.drag
        return GuidanceInput(motion, later, thrust, disturbance, drag, thrust_limits)

    def vehicle(self, now: float, situation: GuidanceInput) -> Vehicle:
        """The same, as predictive control takes it; its time is `now`, s on our clock."""
        return Vehicle(
            now,
            situation.now.position_ned,
            situation.now.velocity_ned,
            self._q,
            self._body_rates,
            (*situation.disturbance, 0.0),
            situation.drag,
        )

    def vehicle_time(self, now: float, position: LocalPosition) -> float:
        """Our time `now` as the vehicle's, s."""
        offset = self._offset()
        return now + (position.vehicle_time - position.received if offset is None else offset)

    def mismatch_warning(self) -> str | None:
        """In words, where the drag is another than the configuration says."""
        told, learned, speed = self.drag.first, self.drag.drag, self.drag.top_speed
        off = learned.per_velocity(speed) - told.per_velocity(speed)
        if not self.drag.certain or abs(off) <= _WORTH_TELLING:
            return None
        return (
            f"the vehicle's drag at {speed:.1f} m/s is {learned.per_velocity(speed):.2f} 1/s, and "
            f"{told.per_velocity(speed):.2f} was assumed; set guidance.drag_per_s to "
            f"{learned.linear:.2f} and guidance.quadratic_drag_per_m to {learned.quadratic:.3f}"
        )

    def _learn_drag(self, before: LocalPosition, now: LocalPosition, slope: Horizontal) -> None:
        dt = now.vehicle_time - before.vehicle_time
        if not 0.0 < dt < _LONGEST:
            return
        old, new = before.velocity_ned, now.velocity_ned
        north, east, down = ((b - a) / dt for a, b in zip(old, new, strict=True))
        # Of the thrust that there was, not of the one asked for.
        vertical = GRAVITY - down
        self.drag.observe(
            dt,
            (0.5 * (old[0] + new[0]), 0.5 * (old[1] + new[1]), 0.5 * (old[2] + new[2])),
            (north - vertical * slope[0], east - vertical * slope[1]),
        )

    def _known(self, slope: Horizontal, motion: VehicleMotion) -> Horizontal:
        """Horizontal acceleration by thrust and drag, m/s²."""
        slowed = self.drag.drag.deceleration(motion.velocity_ned)
        return self.vertical * slope[0] - slowed[0], self.vertical * slope[1] - slowed[1]
