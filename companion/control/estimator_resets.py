"""Resets of the autopilot's estimator: the estimate jumps while the vehicle does not move.

A jump is a change between two samples that neither body rates nor velocity explain. PX4 resets its
position or heading after it has rejected measurements of them for a while. PX4 counts its
resets in ODOMETRY's `reset_counter`, which comes later and does not contain the size of a jump.
Guidance and control work in a frame without jumps:

- All position jumps are subtracted from a position.
- Poses, references and targets have headings without jumps. `EstimatorResets.frame` converts
  between these and the estimator's headings and attitudes.

Horizontal accelerations stay in the estimator's frame, in which position is measured. So a heading
correction of the estimator at once corrects the commanded accelerations, too.
"""

from collections import deque
from math import asin, atan2, hypot, radians, sqrt

from companion.attitude import Quaternion, is_unit
from companion.attitude.rotation import after_constant_rates, wrap_difference
from companion.control.heading_frame import HeadingFrame
from companion.control.rate_lag import RateLag
from companion.guidance.reference import Vector, minus
from companion.vehicle.records import AttitudeSample, LocalPosition

_LONGEST_ATTITUDE_GAP = 0.1
"""Longest time between two attitudes compared for a jump, s; beyond it the rates are unknown."""
_LONGEST_CORRECTED_GAP = 0.025
"""Longest time between two attitudes that add to `EstimatorResets.heading_corrections`, s; over a
longer time the body rates are too uncertain."""
_SMALLEST_ATTITUDE_JUMP = radians(4.0)
"""Smallest attitude jump that is recognised, rad; smaller ones count as noise."""
_SMALLEST_POSITION_JUMP = 0.2
"""Smallest position jump that is recognised, m; smaller ones count as noise."""
_LONGEST_POSITION_GAP = 0.5
"""Longest time between two positions that are compared for a jump, s."""
_LARGEST_ACCELERATION_CHANGE = 10.0
"""Assumed largest change of the vehicle's acceleration between two positions, m/s²; a position
change that it explains is no jump."""
_RESET_MERGE_TIME = 0.5
"""Time within which several jumps count as one reset, s. ODOMETRY reports the same reset later,
because it is sent at 10 Hz."""


class EstimatorResets:
    """Finds the jumps of the autopilot's estimate, adds them up and counts them.

    Attributes:
        frame: the frame that heading jumps do not turn; its `offset` is the sum of the jumps, rad.
        position_shift: sum of the position jumps, m NED.
        heading_corrections: sum of the estimator's gradual heading corrections, rad: heading
            changes that the body rates do not explain, without the jumps; see `StepFrame`.
        total_turn: sum of all turns about the body's z axis, in either direction, rad.
        rate_lag: learned lag of the body rates behind the attitude.
        largest_tilt_jump: largest jump of the thrust axis, rad; it is not compensated.
        newest_attitude: the newest attitude, or None.
        reset_times: when the latest resets were found, s of event-loop time.
    """

    def __init__(self) -> None:
        self.frame = HeadingFrame()
        self.position_shift: Vector = (0.0, 0.0, 0.0)
        self.heading_corrections = self.total_turn = 0.0
        self.rate_lag = RateLag()
        self.largest_tilt_jump = 0.0
        self.reset_times: deque[float] = deque(maxlen=32)
        self.newest_attitude: AttitudeSample | None = None
        self._newest_position: LocalPosition | None = None
        self._reset_counter: int | None = None

    def on_attitude(self, sample: AttitudeSample) -> bool:
        """Compare a newer sample with the last one; return whether the thrust axis jumped."""
        if not is_unit(sample.q):
            return False
        previous, self.newest_attitude = self.newest_attitude, sample
        if previous is None:
            return False
        dt = sample.vehicle_time - previous.vehicle_time
        if not 0.0 < dt <= _LONGEST_ATTITUDE_GAP:
            return False
        rates = self.rate_lag.mean(previous.body_rates, sample.body_rates, dt)
        predicted_q = after_constant_rates(previous.q, rates, dt)
        yaw_jump, tilt_jump, threshold = _attitude_jump(previous, sample, predicted_q, dt)
        thrust_axis_jumped = tilt_jump > threshold
        if abs(yaw_jump) > threshold:
            self.frame = HeadingFrame(wrap_difference(self.frame.offset + yaw_jump))
        elif not thrust_axis_jumped:
            if dt <= _LONGEST_CORRECTED_GAP:
                self.heading_corrections += yaw_jump
                self.total_turn += abs(rates[2]) * dt
                self.rate_lag.learn(previous.body_rates, sample.body_rates, predicted_q, sample.q)
            return False
        self._count_reset(sample.received)
        self.largest_tilt_jump = max(
            self.largest_tilt_jump, tilt_jump if thrust_axis_jumped else 0.0
        )
        return thrust_axis_jumped

    def position_without_jumps(self, position: LocalPosition) -> LocalPosition:
        """The position in the frame without jumps; a new position is first checked for a jump."""
        previous, self._newest_position = self._newest_position, position
        if previous is not None:
            self._find_position_jump(previous, position)
        return position._replace(position_ned=minus(position.position_ned, self.position_shift))

    def forget(self) -> None:
        """Forget all jumps, on the ground: the frame without jumps is then the estimator's."""
        self.frame, self.position_shift = HeadingFrame(), (0.0, 0.0, 0.0)
        self._newest_position = None

    def on_counter(self, counter: int | None, now: float) -> None:
        """Take ODOMETRY's `reset_counter`, which also counts resets too small to be detected."""
        if counter is not None and self._reset_counter not in (None, counter):
            self._count_reset(now)
        self._reset_counter = counter

    def _find_position_jump(self, previous: LocalPosition, position: LocalPosition) -> None:
        dt = position.vehicle_time - previous.vehicle_time
        if not 0.0 < dt <= _LONGEST_POSITION_GAP:
            return
        jump = [
            new - old - 0.5 * dt * (v_old + v_new)
            for old, new, v_old, v_new in zip(
                previous.position_ned,
                position.position_ned,
                previous.velocity_ned,
                position.velocity_ned,
                strict=True,
            )
        ]
        if hypot(*jump) > _SMALLEST_POSITION_JUMP + _LARGEST_ACCELERATION_CHANGE * dt * dt / 8.0:
            north, east, down = self.position_shift
            self.position_shift = (north + jump[0], east + jump[1], down + jump[2])
            self._count_reset(position.received)

    def _count_reset(self, now: float) -> None:
        if not self.reset_times or now - self.reset_times[-1] > _RESET_MERGE_TIME:
            self.reset_times.append(now)


def _attitude_jump(
    previous: AttitudeSample, newest: AttitudeSample, predicted_q: Quaternion, dt: float
) -> tuple[float, float, float]:
    """Jump of the heading, jump of the thrust axis, and the threshold for both; rad."""
    p, q, r = previous.body_rates
    new_p, new_q, new_r = newest.body_rates
    w, x, y, z = predicted_q
    a, b, c, d = newest.q
    # after.q ⊗ predicted⁻¹: the unexplained rotation, about world axes.
    r_w = a * w + b * x + c * y + d * z
    r_x = -a * x + b * w - c * z + d * y
    r_y = -a * y + b * z + c * w - d * x
    r_z = -a * z - b * y + c * x + d * w
    yaw_jump = wrap_difference(2.0 * atan2(r_z, r_w))
    tilt_jump = 2.0 * asin(min(1.0, hypot(r_x, r_y)))
    rate_change = sqrt((new_p - p) ** 2 + (new_q - q) ** 2 + (new_r - r) ** 2)
    return yaw_jump, tilt_jump, _SMALLEST_ATTITUDE_JUMP + 0.5 * rate_change * dt
