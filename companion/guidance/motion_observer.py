"""Observer of horizontal motion and disturbance (wind, bias); history of the thrust's slope."""

from collections import deque
from dataclasses import dataclass
from itertools import islice
from math import exp
from typing import NamedTuple

from companion.attitude.history import locate_time
from companion.guidance.reference import NorthEast, VehicleMotion, clamp_length, rotate

_LARGEST_COUPLING_TIMES_STEP = 0.5
"""Largest product of `ObserverSettings.coupling` and the time between two measurements. With more,
the observer is unstable at low position rates, and takes a gap in positions for wind."""


class ObserverGains(NamedTuple):
    """The observer's gains: correction of each state per error.

    The position is corrected by its own error. Velocity and disturbance are corrected by the error
    of the velocity plus `ObserverSettings.coupling` times the error of the position.

    Attributes:
        position: correction of the position per error, m per m.
        velocity: correction of the velocity per error, m/s per m/s.
        disturbance: correction of the disturbance per error, m/s² per m/s.
    """

    position: float
    velocity: float
    disturbance: float


@dataclass(frozen=True, slots=True)
class ObserverSettings:
    """Settings from which the observer's gains follow.

    Attributes:
        bandwidth: both poles of the error of velocity and disturbance, rad/s.
        position_time: time constant with which the position follows the measured one, s.
        position_coupling: velocity error that has the effect of 1 m of position error, 1/s.
        largest_disturbance: largest estimated disturbance, m/s².
        bandwidth_increase: relative increase of `bandwidth` at a `PositionCorrection.trust` of 1.
        coupling_increase: increase of `position_coupling` at a `trust` of 1, 1/s.
    """

    bandwidth: float
    position_time: float
    position_coupling: float
    largest_disturbance: float
    bandwidth_increase: float = 0.0
    coupling_increase: float = 0.0

    def coupling(self, dt: float, trust: float) -> float:
        """`position_coupling` increased by `trust`, limited so that the observer is stable, 1/s.

        The arguments are those of `gains`.
        """
        return min(
            self.position_coupling + trust * self.coupling_increase,
            _LARGEST_COUPLING_TIMES_STEP / dt,
        )

    def gains(self, dt: float, trust: float = 0.0) -> ObserverGains:
        """The gains for two measurements that are `dt` seconds apart.

        Args:
            dt: time between the two measurements, s.
            trust: trust in the positions, 0 to 1 (`PositionCorrection.trust`).
        """
        bandwidth = (1.0 + trust * self.bandwidth_increase) * self.bandwidth
        position = 1.0 if self.position_time <= 0.0 else 1.0 - exp(-dt / self.position_time)
        return ObserverGains(
            position, 1.0 - exp(-2.0 * bandwidth * dt), (1.0 - exp(-bandwidth * dt)) ** 2 / dt
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
        self.disturbance: NorthEast = (0.0, 0.0)
        self._settings = settings
        self._motion: VehicleMotion | None = None
        self._time = 0.0

    def retune(self, settings: ObserverSettings) -> None:
        """Use other settings from the next measurement on; the estimate continues."""
        self._settings = settings

    def observe(
        self, time: float, measured: VehicleMotion, modelled: NorthEast, trust: float = 0.0
    ) -> None:
        """Take a measured position and velocity.

        The first measurement replaces the estimate, and so does a measurement that is not newer
        than the last one or comes 1 s or more after it.

        Args:
            time: vehicle time of the measurement, s.
            measured: measured motion, NED.
            modelled: mean horizontal acceleration by thrust and drag since the last measurement,
                m/s², NED.
            trust: trust in the positions, 0 to 1 (`PositionCorrection.trust`).
        """
        motion, dt = self._motion, time - self._time
        self._time = time
        if motion is None or not 0.0 < dt < 1.0:
            self._motion = measured
            return
        settings, disturbance = self._settings, self.disturbance
        gains, coupling = settings.gains(dt, trust), settings.coupling(dt, trust)
        position, velocity = list(measured.position_ned), list(measured.velocity_ned)
        new_disturbance = [0.0, 0.0]
        for axis in (0, 1):
            acceleration = modelled[axis] + disturbance[axis]
            p = motion.position_ned[axis] + dt * (
                motion.velocity_ned[axis] + 0.5 * dt * acceleration
            )
            v = motion.velocity_ned[axis] + dt * acceleration
            position_error = position[axis] - p
            coupled_error = velocity[axis] - v + coupling * position_error
            position[axis] = p + gains.position * position_error
            velocity[axis] = v + gains.velocity * coupled_error
            new_disturbance[axis] = disturbance[axis] + gains.disturbance * coupled_error
        self._motion = VehicleMotion(
            (position[0], position[1], position[2]), (velocity[0], velocity[1], velocity[2])
        )
        self.disturbance = clamp_length(
            new_disturbance[0], new_disturbance[1], settings.largest_disturbance
        )

    def rotate_disturbance(self, angle: float) -> None:
        """Rotate the disturbance by `angle` (rad), by which the estimated heading has jumped.

        The vehicle itself did not turn, so it must keep the tilt that balances the disturbance.
        """
        self.disturbance = rotate(*self.disturbance, angle)

    def at(self, time: float, modelled: NorthEast) -> VehicleMotion | None:
        """The motion at `time`, predicted from the newest measurement; None before the first.

        Args:
            time: vehicle time, s.
            modelled: mean horizontal acceleration by thrust and drag from the newest measurement to
                `time`, m/s², NED.
        """
        motion, dt = self._motion, time - self._time
        if motion is None:
            return None
        (north, east, down), (v_north, v_east, v_down) = motion
        a_north, a_east = modelled[0] + self.disturbance[0], modelled[1] + self.disturbance[1]
        return VehicleMotion(
            (
                north + dt * (v_north + 0.5 * dt * a_north),
                east + dt * (v_east + 0.5 * dt * a_east),
                down + dt * v_down,
            ),
            (v_north + dt * a_north, v_east + dt * a_east, v_down),
        )


_MAX_ATTITUDES = 200
"""Number of attitudes kept: 0.8 s at 250 Hz, longer than the delay of any position."""


class SlopeHistory:
    """History of the thrust's slope: horizontal thrust divided by vertical thrust.

    The observer needs the mean slope between the time stamps of two positions. Positions come late
    and at other times than attitudes, so the history keeps the integral of the slope.

    Attributes:
        newest: slope of the newest attitude (north, east), without unit.
    """

    def __init__(self) -> None:
        self._times: deque[float] = deque(maxlen=_MAX_ATTITUDES)
        self._integrals: deque[NorthEast] = deque(maxlen=_MAX_ATTITUDES)
        self.newest: NorthEast = (0.0, 0.0)

    def add(self, time: float, slope: NorthEast) -> None:
        """Add the slope of an attitude; an attitude not newer than the last restarts the history.

        Args:
            time: vehicle time, s.
            slope: north and east, without unit.
        """
        if not self._times or time <= self._times[-1]:
            self._times.clear()
            self._integrals.clear()
            self._times.append(time)
            self._integrals.append((0.0, 0.0))
        else:
            dt = time - self._times[-1]
            north, east = self._integrals[-1]
            last_slope = self.newest
            self._times.append(time)
            self._integrals.append(
                (
                    north + 0.5 * dt * (last_slope[0] + slope[0]),
                    east + 0.5 * dt * (last_slope[1] + slope[1]),
                )
            )
        self.newest = slope

    def forget(self) -> None:
        """Forget all attitudes.

        Called after the estimated heading jumped: older attitudes refer to another north.
        """
        self._times.clear()
        self._integrals.clear()

    def mean(self, start: float, end: float) -> NorthEast:
        """The mean slope between two vehicle times, s.

        Before the first attitude and after the last, the slope is taken as constant. The result is
        `newest` if `end` is not after `start`, or if no attitude is kept.
        """
        if not start < end or not self._times:
            return self.newest
        (n0, e0), (n1, e1) = self._integral(start), self._integral(end)
        return (n1 - n0) / (end - start), (e1 - e0) / (end - start)

    def _integral(self, time: float) -> NorthEast:
        """The integral of the slope from the start of the history to `time`.

        The integral is linear between attitudes, and extrapolated linearly before the first and
        after the last.
        """
        times, integrals = self._times, self._integrals
        if time >= times[-1] or len(times) == 1:
            elapsed = time - times[-1]
            north, east = integrals[-1]
            return north + elapsed * self.newest[0], east + elapsed * self.newest[1]
        later_index, fraction = locate_time(times, time)
        (n0, e0), (n1, e1) = islice(integrals, later_index - 1, later_index + 1)
        return n0 + fraction * (n1 - n0), e0 + fraction * (e1 - e0)
