"""Detects attitudes, positions or velocities that repeat one measurement under new time stamps."""

from math import hypot, inf, nan

from companion.attitude import BodyRates
from companion.vehicle.records import AttitudeSample, LocalPosition

_MIN_REPETITIONS = 10
"""Number of newer messages in a row that must repeat the same numbers to count as frozen."""
_MAX_TURN = 0.05
"""An attitude that repeats is frozen if setpoints command a rotation of more than this, rad."""
_MAX_DISTANCE = 0.02
"""A position that repeats is frozen if the integral of the reported speed exceeds this, m. Motions
in opposite directions add up, because each of them must change the position."""
_POSITION_TIME = 0.5
"""Time for which a position must repeat to be frozen, s; some estimators update at only 5 Hz."""
_MAX_DRIFT = 0.05
"""A velocity that repeats is frozen if its integral is off the position by more than this, m."""
_LONGEST_INTERVAL = 0.1
"""A longer interval between two checks counts as this time, s."""


class _Repetition:
    """Counts how many messages in a row repeat the same numbers, and since when."""

    def __init__(self) -> None:
        self.count, self.since = 0, 0.0
        self._numbers: object = None
        self._received = -inf

    def take(self, now: float, received: float, numbers: object) -> bool:
        """Take the newest message at `now`; return whether it is newer and repeats the last one."""
        if received == self._received:
            return False
        self._received = received
        if numbers != self._numbers:
            self.count, self.since, self._numbers = 0, now, numbers
            return False
        self.count += 1
        return True

    def is_long(self, time: float) -> bool:
        """Whether enough messages repeat the numbers, over a long enough `time` (s)."""
        return self.count >= _MIN_REPETITIONS and time >= _POSITION_TIME


class _Axis:
    """Compares position and velocity along one axis, because only one of them may be frozen."""

    def __init__(self) -> None:
        self._position, self._velocity = _Repetition(), _Repetition()
        self._newest = nan
        self._start = self._distance = self._taken_at = 0.0

    def take(self, now: float, received: float, position: float, velocity: float) -> str | None:
        """Take the newest position (m) and velocity (m/s); return what is frozen, or None."""
        moved, self._newest = position != self._newest, position
        if self._position.take(now, received, position):
            self._distance += abs(velocity) * (now - self._taken_at)
            self._taken_at = now
        elif moved:
            self._distance, self._taken_at = 0.0, now
        if self._position.is_long(now - self._position.since) and self._distance > _MAX_DISTANCE:
            return "LOCAL_POSITION_NED repeats one position, although it reports a speed"
        # Only positions that move count: a simulated vehicle at rest may repeat both.
        if not moved:
            return None
        self._velocity.take(now, received, velocity)
        if self._velocity.count == 0:
            self._start = position
        time = now - self._velocity.since
        drift = abs(position - self._start - velocity * time)
        if self._velocity.is_long(time) and drift > _MAX_DRIFT:
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
        self._attitude = _Repetition()
        self._axes = _Axis(), _Axis(), _Axis()
        self._turn, self._checked_at = 0.0, now

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
            if self._attitude.take(now, sample.received, sample.q):
                self._turn += hypot(*rates) * elapsed
            elif self._attitude.count == 0:
                self._turn = 0.0
            if self._attitude.count >= _MIN_REPETITIONS and self._turn > _MAX_TURN:
                return (
                    "ATTITUDE_QUATERNION repeats one attitude, although setpoints turn the vehicle"
                )
        if position is None:
            return None
        for axis, place, speed in zip(
            self._axes, position.position_ned, position.velocity_ned, strict=True
        ):
            found = axis.take(now, position.received, place, speed)
            if found is not None:
                return found
        return None
