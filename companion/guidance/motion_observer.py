"""Observer of position, velocity and disturbance (wind, bias), and the history of the tilt."""

from collections import deque
from dataclasses import dataclass
from itertools import islice
from math import exp

from companion.attitude.history import between
from companion.guidance.reference import Horizontal, Vector, VehicleMotion, limited, rotated


@dataclass(frozen=True, slots=True)
class ObserverSettings:
    """How strongly measurements correct the observer.

    Attributes:
        bandwidth: of the disturbance, rad/s: both poles of the observer.
        position_time: time constant with which the position follows the measured one, s.
        position_pull: correction of the velocity per position error, 1/s.
        largest: bound on the disturbance, m/s².
    """

    bandwidth: float
    position_time: float
    position_pull: float
    largest: float


class MotionObserver:
    """A model driven by the measured attitude and corrected by the measured motion.

    The horizontal acceleration is that of the thrust by the measured tilt, plus drag, plus a
    disturbance that changes slowly. The measured tilt counts, not the commanded one, so a saturated
    command does not wind the disturbance up.

    Attributes:
        disturbance: horizontal, m/s².
    """

    def __init__(self, settings: ObserverSettings) -> None:
        self.disturbance: Horizontal = (0.0, 0.0)
        self._settings = settings
        self._motion: VehicleMotion | None = None
        self._time = 0.0

    def reset(self) -> None:
        """Start anew: offboard control was not active, or the estimator jumped."""
        self._motion = None
        self.disturbance = (0.0, 0.0)

    def observe(self, time: float, measured: VehicleMotion, known: Horizontal) -> None:
        """Take a measured position and velocity.

        Args:
            time: of the measurement, vehicle time, s.
            measured: m and m/s, NED.
            known: horizontal acceleration by thrust and drag since the last measurement, m/s².
        """
        motion, dt = self._motion, time - self._time
        self._time = time
        if motion is None or not 0.0 < dt < 1.0:
            self._motion = measured
            return
        settings, disturbance = self._settings, self.disturbance
        believed = 1.0 - exp(-2.0 * settings.bandwidth * dt)
        learned = (1.0 - exp(-settings.bandwidth * dt)) ** 2 / dt
        near = 1.0 - exp(-dt / settings.position_time) if settings.position_time > 0.0 else 1.0
        position, velocity = list(measured.position_ned), list(measured.velocity_ned)
        found = [0.0, 0.0]
        for axis in (0, 1):
            acceleration = known[axis] + disturbance[axis]
            p = motion.position_ned[axis] + dt * (
                motion.velocity_ned[axis] + 0.5 * dt * acceleration
            )
            v = motion.velocity_ned[axis] + dt * acceleration
            away = position[axis] - p
            off = velocity[axis] - v + settings.position_pull * away
            position[axis] = p + near * away
            velocity[axis] = v + believed * off
            found[axis] = disturbance[axis] + learned * off
        self._motion = VehicleMotion(_vector(position), _vector(velocity))
        self.disturbance = limited(found[0], found[1], settings.largest)

    def turn(self, angle: float) -> None:
        """Turn the disturbance by a jump of the measured heading, rad.

        The vehicle did not turn: it must keep leaning the same way against the disturbance.
        """
        self.disturbance = rotated(*self.disturbance, angle)

    def at(self, time: float, known: Horizontal) -> VehicleMotion | None:
        """The motion at a vehicle time (s), predicted from the newest measurement.

        Args:
            time: vehicle time, s.
            known: horizontal acceleration by thrust and drag until then, m/s².
        """
        motion, dt = self._motion, time - self._time
        if motion is None:
            return None
        (north, east, down), (v_north, v_east, v_down) = motion
        a_north, a_east = known[0] + self.disturbance[0], known[1] + self.disturbance[1]
        return VehicleMotion(
            (
                north + dt * (v_north + 0.5 * dt * a_north),
                east + dt * (v_east + 0.5 * dt * a_east),
                down + dt * v_down,
            ),
            (v_north + dt * a_north, v_east + dt * a_east, v_down),
        )


def _vector(values: list[float]) -> Vector:
    north, east, down = values
    return north, east, down


_KEPT = 200
"""Attitudes kept: 0.8 s at 250 Hz, longer than any position is delayed."""


class SlopeHistory:
    """Horizontal per vertical thrust over vehicle time, as its running integral.

    Positions come late, seldom, and not in step with guidance. The mean between two of them is
    taken between their own time stamps.
    """

    def __init__(self) -> None:
        self._times: deque[float] = deque(maxlen=_KEPT)
        self._sums: deque[Horizontal] = deque(maxlen=_KEPT)
        self.newest: Horizontal = (0.0, 0.0)

    def add(self, time: float, slope: Horizontal) -> None:
        """Take the slope of an attitude; one that is not newer than the last starts anew.

        Args:
            time: vehicle time, s.
            slope: north and east, no unit.
        """
        if not self._times or time <= self._times[-1]:
            self._times.clear()
            self._sums.clear()
            self._times.append(time)
            self._sums.append((0.0, 0.0))
        else:
            dt = time - self._times[-1]
            north, east = self._sums[-1]
            before = self.newest
            self._times.append(time)
            self._sums.append(
                (
                    north + 0.5 * dt * (before[0] + slope[0]),
                    east + 0.5 * dt * (before[1] + slope[1]),
                )
            )
        self.newest = slope

    def forget(self) -> None:
        """Start anew: the north of the earlier attitudes was another one."""
        self._times.clear()
        self._sums.clear()

    def mean(self, start: float, end: float) -> Horizontal:
        """The mean slope between two vehicle times, s; constant beyond the known attitudes."""
        if not start < end or not self._times:
            return self.newest
        (n0, e0), (n1, e1) = self._integral(start), self._integral(end)
        return (n1 - n0) / (end - start), (e1 - e0) / (end - start)

    def _integral(self, time: float) -> Horizontal:
        """Up to `time`, between and beyond the attitudes along the straight line."""
        times, sums = self._times, self._sums
        if time >= times[-1]:
            after = time - times[-1]
            north, east = sums[-1]
            return north + after * self.newest[0], east + after * self.newest[1]
        if len(times) == 1:
            return sums[0]
        later, share = between(times, time)
        (n0, e0), (n1, e1) = islice(sums, later - 1, later + 1)
        return n0 + share * (n1 - n0), e0 + share * (e1 - e0)
