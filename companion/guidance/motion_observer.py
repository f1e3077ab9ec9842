"""Observer of position, velocity and disturbance (wind, bias), and the history of the tilt."""

from collections import deque
from dataclasses import dataclass
from itertools import islice
from math import exp
from typing import NamedTuple

from companion.attitude.history import locate_time
from companion.guidance.reference import Horizontal, Vector, VehicleMotion, limited, rotated

_LARGEST_PULL_TIMES_STEP = 0.5
"""Largest product of `ObserverSettings.pull` and the time between two measurements: with a larger
one, the observer is unstable at low position rates, and a gap in the positions makes a false wind.
"""


class ObserverGains(NamedTuple):
    """How a measurement corrects the observer.

    The position is corrected per position error. Velocity and disturbance are corrected per error
    of the velocity, to which `ObserverSettings.pull` adds the position error.

    Attributes:
        position: m per m.
        velocity: m/s per m/s.
        disturbance: m/s² per m/s.
    """

    position: float
    velocity: float
    disturbance: float


@dataclass(frozen=True, slots=True)
class ObserverSettings:
    """How strongly measurements correct the observer.

    Attributes:
        bandwidth: both poles of the error of velocity and disturbance, rad/s.
        position_time: time constant with which the position follows the measured one, s.
        position_pull: correction of the velocity per position error, 1/s.
        largest_disturbance: largest disturbance, m/s².
        sharpening: relative increase of the bandwidth with trusted positions.
        trusted_pull: increase of `position_pull` with trusted positions, 1/s.
    """

    bandwidth: float
    position_time: float
    position_pull: float
    largest_disturbance: float
    sharpening: float = 0.0
    trusted_pull: float = 0.0

    def pull(self, dt: float, trust: float) -> float:
        """Correction of the velocity per position error, 1/s; `dt` and `trust` as in `gains`."""
        return min(self.position_pull + trust * self.trusted_pull, _LARGEST_PULL_TIMES_STEP / dt)

    def gains(self, dt: float, trust: float = 0.0) -> ObserverGains:
        """The gains for measurements `dt` seconds apart.

        Args:
            dt: s.
            trust: trust in the positions, 0 to 1 (`PositionCorrection.trust`).
        """
        bandwidth = (1.0 + trust * self.sharpening) * self.bandwidth
        position = 1.0 if self.position_time <= 0.0 else 1.0 - exp(-dt / self.position_time)
        return ObserverGains(
            position,
            1.0 - exp(-2.0 * bandwidth * dt),
            (1.0 - exp(-bandwidth * dt)) ** 2 / dt,
        )


class MotionObserver:
    """A motion model driven by the measured attitude and corrected by the measured motion.

    Only the horizontal motion is modelled; height and vertical speed are those measured. The
    horizontal acceleration is the sum of thrust, drag and a disturbance that changes slowly.
    The thrust follows from the measured tilt, not the commanded one, so that the disturbance does
    not wind up when the command saturates.

    Attributes:
        disturbance: horizontal acceleration by wind and bias, m/s², NED.
    """

    def __init__(self, settings: ObserverSettings) -> None:
        self.disturbance: Horizontal = (0.0, 0.0)
        self._settings = settings
        self._motion: VehicleMotion | None = None
        self._time = 0.0

    def retune(self, settings: ObserverSettings) -> None:
        """Use other settings from the next measurement on; the estimate continues."""
        self._settings = settings

    def observe(
        self, time: float, measured: VehicleMotion, known: Horizontal, trust: float = 0.0
    ) -> None:
        """Take a measured position and velocity.

        The first one is taken as it is, and so is one after 1 s or more without a measurement, or
        one that is not newer than the last.

        Args:
            time: vehicle time of the measurement, s.
            measured: measured motion, NED.
            known: mean horizontal acceleration by thrust and drag since the last measurement, m/s²,
                NED.
            trust: trust in the positions, 0 to 1 (`PositionCorrection.trust`).
        """
        motion, dt = self._motion, time - self._time
        self._time = time
        if motion is None or not 0.0 < dt < 1.0:
            self._motion = measured
            return
        settings, disturbance = self._settings, self.disturbance
        gains, pull = settings.gains(dt, trust), settings.pull(dt, trust)
        position, velocity = list(measured.position_ned), list(measured.velocity_ned)
        found = [0.0, 0.0]
        for axis in (0, 1):
            acceleration = known[axis] + disturbance[axis]
            p = motion.position_ned[axis] + dt * (
                motion.velocity_ned[axis] + 0.5 * dt * acceleration
            )
            v = motion.velocity_ned[axis] + dt * acceleration
            position_error = position[axis] - p
            error = velocity[axis] - v + pull * position_error
            position[axis] = p + gains.position * position_error
            velocity[axis] = v + gains.velocity * error
            found[axis] = disturbance[axis] + gains.disturbance * error
        self._motion = VehicleMotion(_vector(position), _vector(velocity))
        self.disturbance = limited(found[0], found[1], settings.largest_disturbance)

    def turn(self, angle: float) -> None:
        """Rotate the disturbance by `angle` (rad), a jump of the estimated heading.

        The vehicle itself did not turn, so it must keep the tilt that balances the disturbance.
        """
        self.disturbance = rotated(*self.disturbance, angle)

    def at(self, time: float, known: Horizontal) -> VehicleMotion | None:
        """The motion predicted from the newest measurement; None before the first.

        Args:
            time: vehicle time, s.
            known: mean horizontal acceleration by thrust and drag until then, m/s², NED.
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


_KEPT_ATTITUDES = 200
"""Number of attitudes kept: 0.8 s at 250 Hz, longer than the delay of any position."""


class SlopeHistory:
    """History of the slope, the horizontal thrust divided by the vertical thrust.

    The observer needs the mean slope between the time stamps of two positions. These come late and
    at other times than the attitudes, so the history keeps the integral of the slope.

    Attributes:
        newest: slope of the newest attitude (north, east), without unit.
    """

    def __init__(self) -> None:
        self._times: deque[float] = deque(maxlen=_KEPT_ATTITUDES)
        self._sums: deque[Horizontal] = deque(maxlen=_KEPT_ATTITUDES)
        self.newest: Horizontal = (0.0, 0.0)

    def add(self, time: float, slope: Horizontal) -> None:
        """Add the slope of an attitude; one that is not newer than the last restarts the history.

        Args:
            time: vehicle time, s.
            slope: north and east, without unit.
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
        """Forget all attitudes.

        Called after the estimated heading jumped: older attitudes refer to another north.
        """
        self._times.clear()
        self._sums.clear()

    def mean(self, start: float, end: float) -> Horizontal:
        """The mean slope between two vehicle times, s.

        Before the first attitude and after the last, the slope is taken as constant. It is `newest`
        if `end` is not after `start`, or if no attitude is kept.
        """
        if not start < end or not self._times:
            return self.newest
        (n0, e0), (n1, e1) = self._integral(start), self._integral(end)
        return (n1 - n0) / (end - start), (e1 - e0) / (end - start)

    def _integral(self, time: float) -> Horizontal:
        """The integral of the slope from the start of the history to `time`.

        Between attitudes it is interpolated linearly; before the first and after the last it is
        extrapolated linearly.
        """
        times, sums = self._times, self._sums
        if time >= times[-1] or len(times) == 1:
            after = time - times[-1]
            north, east = sums[-1]
            return north + after * self.newest[0], east + after * self.newest[1]
        later, share = locate_time(times, time)
        (n0, e0), (n1, e1) = islice(sums, later - 1, later + 1)
        return n0 + share * (n1 - n0), e0 + share * (e1 - e0)
