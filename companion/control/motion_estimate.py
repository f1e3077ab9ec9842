"""Estimates the motion from measured positions and, between them, from the measured attitude."""

from collections.abc import Callable
from math import atan2

from companion.attitude import BodyRates, Quaternion
from companion.attitude.kinematics import half_tilt_products
from companion.drag import AxisDrag
from companion.guidance import (
    GRAVITY,
    DragEstimate,
    GuidanceInput,
    MotionObserver,
    ObserverSettings,
    VehicleMotion,
)
from companion.guidance.climb_bias import ClimbBias
from companion.guidance.motion_observer import SlopeHistory
from companion.guidance.position_correction import CorrectionSettings, PositionCorrection
from companion.guidance.reference import NorthEast
from companion.nmpc import VehicleSnapshot
from companion.vehicle.records import AttitudeSample, LocalPosition

_LEAST_COS_TILT = 0.2
"""Lower bound of cos(tilt) (78°), so that the slope (see `SlopeHistory`) stays bounded."""
_LONGEST_POSITION_GAP = 0.2
"""Longest time between two positions from which an acceleration is computed, s."""
_DRAG_MISMATCH = 0.15
"""Largest error of the assumed drag that is not reported, 1/s."""


class MotionEstimate:
    """Passes measurements to the motion observer, on the vehicle's clock; predicts the motion.

    Args:
        offset: returns vehicle time minus event-loop time, s, or None before the first attitude.

    Attributes:
        vertical_thrust: upward part of the commanded specific thrust, m/s².
        drag: the drag estimate.
    """

    def __init__(
        self,
        observer: MotionObserver,
        correction: PositionCorrection,
        drag: DragEstimate,
        offset: Callable[[], float | None],
    ) -> None:
        self.vertical_thrust = GRAVITY
        self._observer = observer
        self._correction = correction
        self.drag = drag
        self._offset = offset
        self._slopes = SlopeHistory()
        self._climb_bias = ClimbBias()
        self._q: Quaternion = (1.0, 0.0, 0.0, 0.0)
        self._body_rates = BodyRates(0.0, 0.0, 0.0)
        self._position: LocalPosition | None = None
        self._heading_resets = 0.0
        self._heading = 0.0

    @property
    def disturbance(self) -> NorthEast:
        """Acceleration by wind and bias, m/s², NED."""
        return self._observer.disturbance

    @property
    def _axis_drag(self) -> AxisDrag:
        """The learned part of the drag that depends on the direction of flight."""
        return AxisDrag(self.drag.axis_coefficient, self._heading)

    def retune(self, observer: ObserverSettings, correction: CorrectionSettings) -> None:
        """Use other settings of the observer and the correction from the next position on."""
        self._observer.retune(observer)
        self._correction.retune(correction)

    def note_attitude(self, sample: AttitudeSample) -> None:
        """Take a measured attitude, which gives the direction of the thrust."""
        self._q, self._body_rates = sample.q, sample.body_rates
        self._heading = 2.0 * atan2(sample.q[3], sample.q[0])
        square, ax, ay = half_tilt_products(*sample.q)
        cosine = max(2.0 * square - 1.0, _LEAST_COS_TILT)
        self._slopes.add(sample.vehicle_time, (-2.0 * ay / cosine, 2.0 * ax / cosine))

    def note_heading_resets(self, total: float) -> None:
        """Take the sum of the heading resets, rad.

        If the sum changed, the disturbance is rotated, and the earlier attitudes and the filtered
        position correction are discarded.
        """
        if total != self._heading_resets:
            self._observer.rotate_disturbance(total - self._heading_resets)
            self._slopes.forget()
            self._correction.reset()
            self._heading_resets = total

    def note_position(self, position: LocalPosition, *, offboard_active: bool) -> None:
        """Take a measured position and velocity; the same message again is ignored.

        Drag is learned only while offboard is active.
        """
        before, self._position = self._position, position
        if before is not None and position.vehicle_time == before.vehicle_time:
            return
        since = position.vehicle_time if before is None else before.vehicle_time
        slope = self._slopes.mean(since, position.vehicle_time)
        north, east, down = position.velocity_ned
        down = self._climb_bias.corrected_speed(
            position.vehicle_time, position.position_ned[2], down
        )
        measured = self._correction.corrected_motion(
            position.vehicle_time, VehicleMotion(position.position_ned, (north, east, down))
        )
        modelled = self._modelled_acceleration(slope, measured)
        self._observer.observe(position.vehicle_time, measured, modelled, self._correction.trust)
        if offboard_active and before is not None:
            self._learn_drag(before, position, slope)

    def guidance_input(
        self, now: float, ahead: float, thrust_limits: tuple[float, float]
    ) -> GuidanceInput:
        """The motion at `now` and `ahead` seconds later, with thrust, disturbance and drag.

        Args:
            now: event-loop time, s.
            ahead: prediction time, s.
            thrust_limits: smallest and largest available specific thrust, m/s².

        Raises:
            RuntimeError: no position has come yet.
        """
        if self._position is None:
            raise RuntimeError("guidance was asked to hold before any position came")
        time = self.vehicle_time(now, self._position)
        measured = VehicleMotion(self._position.position_ned, self._position.velocity_ned)
        slope = self._slopes.mean(self._position.vehicle_time, time)
        motion = self._observer.at(time, self._modelled_acceleration(slope, measured)) or measured
        slope = self._slopes.mean(self._position.vehicle_time, time + ahead)
        modelled = self._modelled_acceleration(slope, motion)
        predicted = self._observer.at(time + ahead, modelled) or measured
        north, east = self._slopes.newest
        thrust = self.vertical_thrust * north, self.vertical_thrust * east
        disturbance, drag = self._observer.disturbance, self.drag.drag
        return GuidanceInput(
            motion, predicted, thrust, disturbance, drag, thrust_limits, self._axis_drag
        )

    def vehicle(self, now: float, inputs: GuidanceInput) -> VehicleSnapshot:
        """State of the vehicle for the solver of predictive control.

        Args:
            now: time of the state, s of event-loop time.
            inputs: motion, disturbance and drag at `now`.
        """
        north, east = inputs.disturbance
        return VehicleSnapshot(
            now,
            inputs.now.position_ned,
            inputs.now.velocity_ned,
            self._q,
            self._body_rates,
            (north, east, 0.0),
            inputs.drag,
            inputs.axis_drag.coefficient,
        )

    def vehicle_time(self, now: float, position: LocalPosition) -> float:
        """Convert `now` from event-loop time to the time of the vehicle's clock, s.

        Before the offset of that clock is known, `position` counts as measured when it arrived.
        """
        offset = self._offset()
        return now + (position.vehicle_time - position.received if offset is None else offset)

    def mismatch_warning(self) -> str | None:
        """Advice to change the drag keys if the learned drag differs from them; else None."""
        if (mismatch := self._drag_mismatch()) is None:
            return None
        drag, (speed, learned, assumed) = self.drag.drag, mismatch
        return (
            f"the vehicle's drag at {speed:.1f} m/s is {learned:.2f} 1/s, but "
            f"{assumed:.2f} was assumed; set guidance.drag_per_s to "
            f"{drag.linear:.2f} and guidance.quadratic_drag_per_m to {drag.quadratic:.3f}"
        )

    def learned_note(self) -> str | None:
        """A message that the learned drag differs from the assumed one; None: they are similar."""
        if (mismatch := self._drag_mismatch()) is None:
            return None
        speed, learned, assumed = mismatch
        return (
            f"the vehicle's drag at {speed:.1f} m/s is {learned:.2f} 1/s; this "
            f"flight began with {assumed:.2f} 1/s, and the vehicle's next flight begins with the "
            "drag that this flight learned"
        )

    def _drag_mismatch(self) -> tuple[float, float, float] | None:
        """Top speed, m/s; learned and assumed drag at it, 1/s; None: nearly equal, or uncertain."""
        speed = self.drag.top_speed
        learned = self.drag.drag.per_velocity(speed)
        assumed = self.drag.prior_drag.per_velocity(speed)
        if not self.drag.certain or abs(learned - assumed) <= _DRAG_MISMATCH:
            return None
        return speed, learned, assumed

    def _learn_drag(self, before: LocalPosition, after: LocalPosition, slope: NorthEast) -> None:
        dt = after.vehicle_time - before.vehicle_time
        if not 0.0 < dt < _LONGEST_POSITION_GAP:
            return
        old, new = before.velocity_ned, after.velocity_ned
        north, east, down = ((b - a) / dt for a, b in zip(old, new, strict=True))
        # The measured acceleration gives the actual thrust, which differs from the commanded one.
        vertical_thrust = GRAVITY - down
        self.drag.observe(
            dt,
            (0.5 * (old[0] + new[0]), 0.5 * (old[1] + new[1]), 0.5 * (old[2] + new[2])),
            (north - vertical_thrust * slope[0], east - vertical_thrust * slope[1]),
            self._heading,
        )

    def _modelled_acceleration(self, slope: NorthEast, motion: VehicleMotion) -> NorthEast:
        """Horizontal acceleration due to thrust and drag, m/s², without the disturbance."""
        north, east, _ = motion.velocity_ned
        drag = self.drag.drag.deceleration(motion.velocity_ned)
        axis_drag = self._axis_drag.deceleration(north, east)
        return (
            self.vertical_thrust * slope[0] - drag[0] - axis_drag[0],
            self.vertical_thrust * slope[1] - drag[1] - axis_drag[1],
        )
