"""What guidance knows of the motion: measured positions, carried on by the measured attitude."""

from companion.attitude.kinematics import tilt_products
from companion.guidance import GRAVITY, MotionObserver, Situation, VehicleMotion
from companion.guidance.motion_observer import Horizontal
from companion.mavlink.records import LocalPosition
from companion.mavlink.samples import AttitudeSample

_LEAST_COSINE = 0.2
"""Of the tilt; beyond 78° the thrust is not what height hold asked for."""


class MotionEstimate:
    """Feeds the observer, on the vehicle's clock; and says how the motion goes on.

    Attributes:
        vertical: upward part of the specific thrust that is asked for, m/s².

    Args:
        observer: of position, velocity and disturbance.
        drag: linear drag per mass, 1/s.
    """

    def __init__(self, observer: MotionObserver, drag: float) -> None:
        self.vertical = GRAVITY
        self._observer = observer
        self._drag = drag
        self._slope: Horizontal = (0.0, 0.0)
        self._north = self._east = 0.0
        self._samples = 0
        self._position: LocalPosition | None = None

    def note_attitude(self, sample: AttitudeSample) -> None:
        """Take an attitude; it tells where the thrust points."""
        square, ax, ay = tilt_products(*sample.q)
        cosine = max(2.0 * square - 1.0, _LEAST_COSINE)
        self._slope = north, east = -2.0 * ay / cosine, 2.0 * ax / cosine
        self._north += north
        self._east += east
        self._samples += 1

    def note_position(self, position: LocalPosition) -> None:
        """Take a measured position and velocity; the same one twice counts once."""
        if self._position is not None and position.vehicle_time == self._position.vehicle_time:
            return
        self._position = position
        slope = self._slope
        if self._samples:
            slope = self._north / self._samples, self._east / self._samples
        measured = VehicleMotion(position.position_ned, position.velocity_ned)
        known = self._known(slope, measured)
        self._observer.observe(position.vehicle_time, measured, known)
        self._north = self._east = 0.0
        self._samples = 0

    def situation(self, now: float, ahead: float, thrust_limits: tuple[float, float]) -> Situation:
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
        time = self._position.vehicle_time + now - self._position.received
        still = VehicleMotion(self._position.position_ned, self._position.velocity_ned)
        motion = self._observer.at(time, self._known(self._slope, still)) or still
        known = self._known(self._slope, motion)
        later = self._observer.at(time + ahead, known) or still
        north, east = self._slope
        thrust = self.vertical * north, self.vertical * east
        return Situation(motion, later, thrust, self._observer.disturbance, thrust_limits)

    def _known(self, slope: Horizontal, motion: VehicleMotion) -> Horizontal:
        """Horizontal acceleration by thrust and drag, m/s²."""
        north, east, _ = motion.velocity_ned
        return (
            self.vertical * slope[0] - self._drag * north,
            self.vertical * slope[1] - self._drag * east,
        )
