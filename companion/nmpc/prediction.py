"""Where the vehicle will be when an answer acts: what was asked of it is still under way."""

from collections.abc import Sequence
from dataclasses import replace
from math import hypot, sin, sqrt

from companion.attitude import wrap_angle
from companion.attitude.kinematics import heading_of, rates_to_speed, tilt_products
from companion.attitude.representation import normalised
from companion.nmpc.messages import Input, Vehicle
from companion.nmpc.model import Given, Motion, integrator
from companion.nmpc.models import make_model
from companion.nmpc.settings import Settings

_LEAST_COSINE = 0.2
"""Of the tilt, below which the models do not reach: 78°."""
_FURTHEST = sqrt(1.0 - _LEAST_COSINE**2)
"""The length of the coefficients there."""

_LONGEST_STEP = 0.02
"""s; no input changes oftener."""


class ToppledError(Exception):
    """The vehicle is tilted further than the models reach."""


def motion_of(vehicle: Vehicle) -> Motion:
    """The motion as the models have it.

    Raises:
        InvalidQuaternionError: the attitude is not a unit quaternion.
        ToppledError: it is tilted further than 78°.
    """
    w, x, y, z = normalised(vehicle.q)
    square, ax, ay = tilt_products(w, x, y, z)
    if 2.0 * square - 1.0 < _LEAST_COSINE:
        raise ToppledError
    speed_north, speed_east, _ = rates_to_speed(w, x, y, z, *vehicle.body_rates)
    return Motion(
        *vehicle.position,
        *vehicle.velocity,
        -2.0 * ay,
        2.0 * ax,
        heading_of(square**0.5, w, z),
        speed_north,
        speed_east,
    )


class Predictor:
    """Carries a motion on through the inputs that act meanwhile, by the model `limited`.

    Args:
        settings: the vehicle's.
    """

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self._advance = integrator(make_model(replace(settings, model="limited")))

    def ahead(self, vehicle: Vehicle, inputs: Sequence[Input], until: float) -> Motion:
        """The motion at the time `until`, an input acting from one dead time after its own time.

        Raises:
            InvalidQuaternionError: as `motion_of`.
            ToppledError: as `motion_of`, or it will be tilted so far.
        """
        motion = motion_of(vehicle)
        time = vehicle.time
        given = Given(*vehicle.disturbance, 0.0, 0.0, *vehicle.drag)
        acting = [one for one in inputs if self._acts(one) <= time][-1:] or [*inputs[:1]]
        current = acting[0] if acting else self._kept(vehicle.time, motion)
        for following in [one for one in inputs if time < self._acts(one) < until]:
            motion = self._carried(motion, current, self._acts(following) - time, given)
            time, current = self._acts(following), following
        motion = self._carried(motion, current, until - time, given)
        if hypot(motion.north, motion.east) > _FURTHEST:
            raise ToppledError
        return motion

    def _acts(self, one: Input) -> float:
        return one.time + self._settings.dead_time

    def _kept(self, time: float, motion: Motion) -> Input:
        """What keeps the attitude and the height of a motion."""
        upright = (1.0 - motion.north**2 - motion.east**2) ** 0.5
        thrust = self._settings.gravity / upright
        return Input(time, motion.north, motion.east, motion.heading, thrust)

    def _carried(self, motion: Motion, current: Input, span: float, given: Given) -> Motion:
        heading = motion.heading + wrap_angle(current.heading - motion.heading)
        # The planner takes no longer target than its limit allows.
        length = hypot(current.north, current.east)
        share = min(1.0, sin(self._settings.max_tilt) / max(length, 1e-9))
        control = (share * current.north, share * current.east, heading, current.thrust)
        steps = int(span / _LONGEST_STEP) + 1
        for _ in range(steps):
            after = self._advance(motion, control, list(given), span / steps)
            motion = Motion(*(float(value) for value in after.elements()))
        return motion
