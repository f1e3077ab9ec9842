"""Maneuver `identify`: doublets that measure the response to body rates and thrust."""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

from companion.attitude import BodyRates
from companion.guidance.maneuvers import check_times_between
from companion.guidance.reference import Pose, Reference, VerticalMode

_FIRST_DOUBLET_FRACTION = 0.5
"""Size of the first doublet of an axis, relative to the second one. With doublets of equal size, a
slew limit could not be told from a lag."""
_REST_TIME = 0.5
"""Time of zero rates after a doublet of body rates, in which the slowest axis comes to rest, s."""
_CLIMB_COUNT = 3


class _Doublet(NamedTuple):
    """One doublet +A, −A, +A (lasting T, 2T, T) of body rates or of vertical acceleration.

    Attributes:
        step_time: T, s.
        body_rates: A of a doublet of body rates, rad/s; None: a doublet of vertical acceleration.
        climb_acceleration: A of a doublet of vertical acceleration, m/s², positive up.
    """

    step_time: float
    body_rates: BodyRates | None = None
    climb_acceleration: float = 0.0

    @property
    def duration(self) -> float:
        """Duration, s, including the rest after a doublet of body rates."""
        return 4.0 * self.step_time + (0.0 if self.body_rates is None else _REST_TIME)

    def at(self, time: float, hold: Reference) -> Reference:
        """The reference `time` s after the beginning; `hold` is the reference of position hold."""
        if self.body_rates is None:
            return self._climb_reference(time, hold)
        sign = self._doublet_sign(time)
        return hold._replace(horizontal=BodyRates(*(sign * rate for rate in self.body_rates)))

    def _climb_reference(self, time: float, hold: Reference) -> Reference:
        step = self.step_time
        if time < step:
            speed, height = time, 0.5 * time * time
        elif time < 3.0 * step:
            speed = 2.0 * step - time
            height = step * step - 0.5 * speed * speed
        else:
            speed = time - 4.0 * step
            height = 0.5 * speed * speed
        north, east, down = hold.position_ned
        climb_acceleration = self.climb_acceleration
        return hold._replace(
            position_ned=(north, east, down - climb_acceleration * height),
            velocity_ned=(0.0, 0.0, -climb_acceleration * speed),
            acceleration_ned=(0.0, 0.0, -climb_acceleration * self._doublet_sign(time)),
            vertical=VerticalMode.HEIGHT_IN_STEPS,
        )

    def _doublet_sign(self, time: float) -> float:
        if time >= 4.0 * self.step_time:
            return 0.0
        return -1.0 if self.step_time <= time < 3.0 * self.step_time else 1.0


@dataclass(frozen=True)
class Doublets:
    """Doublets +A, −A, +A (lasting T, 2T, T) of roll, pitch and yaw rate, and of climb.

    Each axis is excited with half its rate, then with the full rate. The angle changes by A·T at
    most and then returns to its value before the doublet. Three equal doublets of the vertical
    acceleration follow, in closed loop: the reference contains the doublet. Position hold corrects
    the drift for `settle_time` seconds before each doublet and at the end.

    Attributes:
        tilt_rate: A of roll and pitch, rad/s.
        tilt_step_time: T of roll and pitch, s.
        yaw_rate: A of yaw, rad/s.
        yaw_step_time: T of yaw, s; yaw responds more slowly.
        climb_acceleration: A of the vertical acceleration, m/s².
        climb_step_time: T of the vertical acceleration, s.
        settle_time: time of position hold before each doublet and at the end, s.
    """

    tilt_rate: float
    tilt_step_time: float
    yaw_rate: float
    yaw_step_time: float
    climb_acceleration: float
    climb_step_time: float
    settle_time: float
    name: str = "identify"

    @property
    def duration(self) -> float:
        """Duration of all doublets, their rests and the times of position hold, s."""
        return self.settle_time + sum(
            doublet.duration + self.settle_time for doublet in self._doublets
        )

    @cached_property
    def _doublets(self) -> tuple[_Doublet, ...]:
        tilt_rate, yaw_rate = self.tilt_rate, self.yaw_rate
        rate_doublets = [
            _Doublet(step, BodyRates(*(fraction * rate for rate in axis)))
            for step, axis in (
                (self.tilt_step_time, (tilt_rate, 0.0, 0.0)),
                (self.tilt_step_time, (0.0, tilt_rate, 0.0)),
                (self.yaw_step_time, (0.0, 0.0, yaw_rate)),
            )
            for fraction in (_FIRST_DOUBLET_FRACTION, 1.0)
        ]
        climb_doublet = _Doublet(self.climb_step_time, climb_acceleration=self.climb_acceleration)
        return *rate_doublets, *(_CLIMB_COUNT * [climb_doublet])

    def check_times(self) -> list[float]:
        """Times to check, s: the beginning, every 0.01 s of doublets and rests, and the end."""
        times, begin = [0.0], 0.0
        for doublet in self._doublets:
            begin += self.settle_time
            times += check_times_between(begin, begin + doublet.duration)
            begin += doublet.duration
        return [*times, self.duration]

    def at(self, time: float, start: Pose) -> Reference:
        """The reference: body rates or a climb in a doublet, position hold between doublets."""
        hold = Reference(start.position_ned, heading=start.heading)
        for doublet in self._doublets:
            time -= self.settle_time
            if time < 0.0:
                break
            if time < doublet.duration:
                return doublet.at(time, hold)
            time -= doublet.duration
        return hold
