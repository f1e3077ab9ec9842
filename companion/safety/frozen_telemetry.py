"""Detects attitudes, positions or velocities that repeat one measurement under new time stamps."""

from math import hypot, inf, nan

from companion.attitude import BodyRates
from companion.vehicle.records import AttitudeSample, LocalPosition

_MIN_REPETITIONS = 10
"""Number of newer messages in a row that must repeat the same numbers to count as frozen."""
_MAX_ROTATION = 0.05
"""An attitude that repeats is frozen if setpoints command a rotation of more than this, rad."""
_MAX_DISTANCE = 0.02
"""A position that repeats is frozen if the integral of the reported speed exceeds this, m. Motions
in opposite directions add up, because each of them must change the position."""
_MIN_REPETITION_TIME = 0.5
"""Time for which a position must repeat to be frozen, s; some estimators update at only 5 Hz."""
_MAX_DRIFT = 0.05
"""A velocity that repeats is frozen if its integral is off the position by more than this, m."""
_LONGEST_INTERVAL = 0.1
"""A longer interval between two checks counts as this time, s."""


class _RepetitionCounter:
    """Counts how many messages in a row repeat the same numbers, and since when."""

    def __init__(self) -> None:
        self.count, self.since = 0, 0.0
        self._latest_values: object = None
        self._latest_arrival = -inf

    def add(self, now: float, arrival: float, values: object) -> bool:
        """Count the newest message; return whether it is newer and repeats the last one."""
        if arrival == self._latest_arrival:
            return False
        self._latest_arrival = arrival
        if values != self._latest_values:
            self.count, self.since, self._latest_values = 0, now, values
            return False
        self.count += 1
        return True

    def is_long_enough(self, duration: float) -> bool:
        """Whether the repetitions are enough to count as frozen, by number and `duration` (s)."""
        return self.count >= _MIN_REPETITIONS and duration >= _MIN_REPETITION_TIME


class _AxisCheck:
    """Compares position and velocity along one axis, because only one of them may be frozen."""

    def __init__(self) -> None:
        self._position, self._velocity = _RepetitionCounter(), _RepetitionCounter()
        self._newest_position = nan
        self._start_position = self._reported_distance = self._distance_updated_at = 0.0

    def find_frozen(
        self, now: float, arrival: float, position: float, velocity: float
    ) -> str | None:
        """Take the newest position (m) and velocity (m/s); return what is frozen, or None."""
        has_moved, self._newest_position = position != self._newest_position, position
        if self._position.add(now, arrival, position):
            self._reported_distance += abs(velocity) * (now - self._distance_updated_at)
            self._distance_updated_at = now
        elif has_moved:
            self._reported_distance, self._distance_updated_at = 0.0, now
        if (
            self._position.is_long_enough(now - self._position.since)
            and self._reported_distance > _MAX_DISTANCE
        ):
            return "LOCAL_POSITION_NED repeats one position, although it reports a speed"
        # Only positions that move count: a simulated vehicle at rest may repeat both.
        if not has_moved:
            return None
        self._velocity.add(now, arrival, velocity)
        if self._velocity.count == 0:
            self._start_position = position
        repetition_time = now - self._velocity.since
        drift = abs(position - self._start_position - velocity * repetition_time)
        if self._velocity.is_long_enough(repetition_time) and drift > _MAX_DRIFT:
            return "LOCAL_POSITION_NED repeats one velocity, but its positions show another one"
        return None


class FrozenTelemetry:
    """Finds an attitude, position or velocity that repeats itself although it must change.

    Sensor noise changes an estimator's numbers with each message. Numbers that repeat to the last
    bit count as frozen only if other data contradict them: an attitude although setpoints command
    rotation, a position although the reported velocity is not zero, or a velocity that does not
    match the positions. So a simulated vehicle at perfect rest is not frozen. Each axis is judged
    separately.
    """

    def __init__(self) -> None:
        self.begin(0.0)

    def begin(self, now: float) -> None:
        """Note that control begins at `now`, s of event-loop time; forget all earlier messages."""
        self._attitude = _RepetitionCounter()
        self._axes = _AxisCheck(), _AxisCheck(), _AxisCheck()
        self._commanded_rotation, self._checked_at = 0.0, now

    def find_frozen(
        self,
        now: float,
        sample: AttitudeSample | None,
        rates: BodyRates,
        position: LocalPosition | None,
    ) -> str | None:
        """Take the newest messages; return what is frozen, in words, or None.

        Args:
            now: s of event-loop time; to be called about 50 times a second.
            sample: the newest attitude.
            rates: body rates of the newest setpoint, rad/s.
            position: the newest position.
        """
        elapsed = min(now - self._checked_at, _LONGEST_INTERVAL)
        self._checked_at = now
        if sample is not None:
            if self._attitude.add(now, sample.received, sample.q):
                self._commanded_rotation += hypot(*rates) * elapsed
            elif self._attitude.count == 0:
                self._commanded_rotation = 0.0
            if (
                self._attitude.count >= _MIN_REPETITIONS
                and self._commanded_rotation > _MAX_ROTATION
            ):
                return (
                    "ATTITUDE_QUATERNION repeats one attitude, although setpoints turn the vehicle"
                )
        if position is None:
            return None
        for axis, axis_position, axis_velocity in zip(
            self._axes, position.position_ned, position.velocity_ned, strict=True
        ):
            frozen_telemetry = axis.find_frozen(
                now, position.received, axis_position, axis_velocity
            )
            if frozen_telemetry is not None:
                return frozen_telemetry
        return None
