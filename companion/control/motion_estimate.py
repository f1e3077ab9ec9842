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
from companion.guidance.motion_observer import SlopeHistory
from companion.guidance.position_correction import CorrectionSettings, PositionCorrection
from companion.guidance.reference import NorthEast
from companion.guidance.vertical_correction import VerticalCorrection, VerticalMotion
from companion.nmpc import VehicleSnapshot
from companion.vehicle.records import AttitudeSample, LocalPosition

_LEAST_COS_TILT = 0.2
"""Lower bound of cos(tilt) (78°), so that the thrust's slope (see `SlopeHistory`) stays bounded."""
_LONGEST_POSITION_GAP = 0.2
"""Longest time between two positions from which an acceleration is computed, s."""
_DRAG_MISMATCH = 0.15
"""Largest error of the assumed drag that is not reported, 1/s."""


class MotionEstimate:
    """Passes measurements to the motion observer, on the vehicle's clock; predicts the motion.

    Args:
        clock_offset: returns vehicle time minus event-loop time, s; None before the first attitude.

    Attributes:
        vertical_thrust: upward part of the commanded specific thrust, m/s².
        drag: the drag estimate.
    """

    def __init__(
        self,
        observer: MotionObserver,
        correction: PositionCorrection,
        drag: DragEstimate,
        clock_offset: Callable[[], float | None],
    ) -> None:
        self.vertical_thrust = GRAVITY
        self._observer = observer
        self._correction = correction
        self.drag = drag
        self._clock_offset = clock_offset
        self._slopes = SlopeHistory()
        self._vertical_correction = VerticalCorrection()
        self._q: Quaternion = (1.0, 0.0, 0.0, 0.0)
        self._body_rates = BodyRates(0.0, 0.0, 0.0)
        self._position: LocalPosition | None = None
        self._heading_reset_sum = 0.0
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
        a_squared, ax, ay = half_tilt_products(*sample.q)
        cosine = max(2.0 * a_squared - 1.0, _LEAST_COS_TILT)
        self._slopes.add(sample.vehicle_time, (-2.0 * ay / cosine, 2.0 * ax / cosine))

    def note_heading_resets(self, heading_reset_sum: float) -> None:
        """Take the sum of the heading resets, rad.

        If the sum changed, the disturbance is rotated, and the earlier attitudes and the filtered
        position correction are discarded.
        """
        if heading_reset_sum != self._heading_reset_sum:
            self._observer.rotate_disturbance(heading_reset_sum - self._heading_reset_sum)
            self._slopes.forget()
            self._correction.reset()
            self._heading_reset_sum = heading_reset_sum

    def note_position(self, position: LocalPosition, *, offboard_active: bool) -> None:
        """Take a measured position and velocity; the same message again is ignored.

        Drag is learned only while offboard is active.
        """
        previous, self._position = self._position, position
        if previous is not None and position.vehicle_time == previous.vehicle_time:
            return
        time, (north, east, down) = position.vehicle_time, position.position_ned
        slope = self._slopes.mean(time if previous is None else previous.vehicle_time, time)
        v_north, v_east, v_down = position.velocity_ned
        down, v_down = self._vertical_correction.corrected(time, VerticalMotion(down, v_down))
        measured_motion = self._correction.corrected_motion(
            time, VehicleMotion((north, east, down), (v_north, v_east, v_down))
        )
        modelled_acceleration = self._modelled_acceleration(slope, measured_motion)
        self._observer.observe(time, measured_motion, modelled_acceleration, self._correction.trust)
        if offboard_active and previous is not None:
            self._learn_drag(previous, position, slope)

    def guidance_input(
        self, now: float, prediction_time: float, thrust_limits: tuple[float, float]
    ) -> GuidanceInput:
        """The motion at `now` and `prediction_time` s later, with thrust, disturbance and drag.

        Args:
            now: event-loop time, s.
            prediction_time: time from `now` to the predicted motion, s.
            thrust_limits: smallest and largest available specific thrust, m/s².

        Raises:
            RuntimeError: no position has come yet.
        """
        if self._position is None:
            raise RuntimeError("guidance was asked to hold before any position had come")
        time = self.vehicle_time(now, self._position)
        measured_motion = VehicleMotion(self._position.position_ned, self._position.velocity_ned)
        slope = self._slopes.mean(self._position.vehicle_time, time)
        present_motion = (
            self._observer.at(time, self._modelled_acceleration(slope, measured_motion))
            or measured_motion
        )
        slope = self._slopes.mean(self._position.vehicle_time, time + prediction_time)
        modelled_acceleration = self._modelled_acceleration(slope, present_motion)
        predicted_motion = (
            self._observer.at(time + prediction_time, modelled_acceleration) or measured_motion
        )
        north, east = self._slopes.newest
        thrust = self.vertical_thrust * north, self.vertical_thrust * east
        disturbance, drag = self._observer.disturbance, self.drag.drag
        return GuidanceInput(
            present_motion,
            predicted_motion,
            thrust,
            disturbance,
            drag,
            thrust_limits,
            self._axis_drag,
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
            inputs.present.position_ned,
            inputs.present.velocity_ned,
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
        clock_offset = self._clock_offset()
        return now + (
            position.vehicle_time - position.received if clock_offset is None else clock_offset
        )

    def mismatch_warning(self) -> str | None:
        """Advice to change the drag keys if the learned drag differs from them; else None."""
        if (mismatch := self._drag_mismatch()) is None:
            return None
        drag, (speed, learned_drag, assumed_drag) = self.drag.drag, mismatch
        return (
            f"the vehicle's drag at {speed:.1f} m/s is {learned_drag:.2f} 1/s, but "
            f"{assumed_drag:.2f} was assumed; set guidance.drag_per_s to "
            f"{drag.linear:.2f} and guidance.quadratic_drag_per_m to {drag.quadratic:.3f}"
        )

    def learned_note(self) -> str | None:
        """A message that the learned drag differs from the assumed one; None: they are similar."""
        if (mismatch := self._drag_mismatch()) is None:
            return None
        speed, learned_drag, assumed_drag = mismatch
        return (
            f"the vehicle's drag at {speed:.1f} m/s is {learned_drag:.2f} 1/s; this "
            f"flight began with {assumed_drag:.2f} 1/s, and the vehicle's next flight begins with "
            "the drag that this flight learned"
        )

    def _drag_mismatch(self) -> tuple[float, float, float] | None:
        """Top speed, m/s; learned and assumed drag at top speed, 1/s; None: no sure mismatch."""
        speed = self.drag.top_speed
        learned_drag = self.drag.drag.per_velocity(speed)
        assumed_drag = self.drag.prior_drag.per_velocity(speed)
        if not self.drag.certain or abs(learned_drag - assumed_drag) <= _DRAG_MISMATCH:
            return None
        return speed, learned_drag, assumed_drag

    def _learn_drag(self, previous: LocalPosition, newest: LocalPosition, slope: NorthEast) -> None:
        dt = newest.vehicle_time - previous.vehicle_time
        if not 0.0 < dt < _LONGEST_POSITION_GAP:
            return
        old_velocity, new_velocity = previous.velocity_ned, newest.velocity_ned
        north, east, down = ((b - a) / dt for a, b in zip(old_velocity, new_velocity, strict=True))
        # The measured acceleration gives the actual thrust, which differs from the commanded one.
        vertical_thrust = GRAVITY - down
        self.drag.observe(
            dt,
            (
                0.5 * (old_velocity[0] + new_velocity[0]),
                0.5 * (old_velocity[1] + new_velocity[1]),
                0.5 * (old_velocity[2] + new_velocity[2]),
            ),
            (north - vertical_thrust * slope[0], east - vertical_thrust * slope[1]),
            self._heading,
        )

    def _modelled_acceleration(self, slope: NorthEast, motion: VehicleMotion) -> NorthEast:
        """Horizontal acceleration by thrust and drag, m/s² NED; `slope`: see `SlopeHistory`."""
        north, east, _ = motion.velocity_ned
        drag = self.drag.drag.deceleration(motion.velocity_ned)
        axis_drag = self._axis_drag.deceleration(north, east)
        return (
            self.vertical_thrust * slope[0] - drag[0] - axis_drag[0],
            self.vertical_thrust * slope[1] - drag[1] - axis_drag[1],
        )
