"""Predicts the motion, under the earlier control inputs, until an answer takes effect."""

from collections.abc import Sequence
from math import hypot, sin, sqrt

from companion.attitude import wrap_angle
from companion.attitude.kinematics import half_tilt_products, heading_of, rates_to_speed
from companion.attitude.representation import normalised
from companion.nmpc.coefficient_model import coefficient_model
from companion.nmpc.messages import ControlInput, VehicleSnapshot
from companion.nmpc.model import Conditions, Motion, integrator
from companion.nmpc.settings import Settings

_LEAST_COSINE = 0.2
"""cos(tilt) of the largest tilt that the models allow, 78°."""
_LONGEST_COEFFICIENTS = sqrt(1.0 - _LEAST_COSINE**2)
"""|c| at the largest tilt that the models allow."""

_LONGEST_STEP = 0.02
"""Longest integration step, s."""


class TiltedTooFarError(Exception):
    """The tilt is larger than the models allow."""


def motion_of(vehicle: VehicleSnapshot) -> Motion:
    """The state of the vehicle, converted to the `Motion` of the models.

    Raises:
        InvalidQuaternionError: the attitude is not a unit quaternion.
        TiltedTooFarError: the tilt exceeds 78°.
    """
    w, x, y, z = normalised(vehicle.q)
    a_squared, ax, ay = half_tilt_products(w, x, y, z)
    if 2.0 * a_squared - 1.0 < _LEAST_COSINE:
        raise TiltedTooFarError
    speed_north, speed_east, _ = rates_to_speed(w, x, y, z, *vehicle.body_rates)
    return Motion(
        *vehicle.position,
        *vehicle.velocity,
        -2.0 * ay,
        2.0 * ax,
        heading_of(a_squared**0.5, w, z),
        speed_north,
        speed_east,
    )


def conditions_of(vehicle: VehicleSnapshot) -> Conditions:
    """Wind and drag of the vehicle's state, converted to the `Conditions` of the models."""
    return Conditions(*vehicle.disturbance, *vehicle.drag, vehicle.axis_drag)


class Predictor:
    """Integrates the `coefficient_model` to a later time, with the control inputs until then."""

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self._model = coefficient_model(settings)
        self._advance = integrator(self._model)

    def predict(
        self, vehicle: VehicleSnapshot, inputs: Sequence[ControlInput], end_time: float
    ) -> Motion:
        """The motion at `end_time`, s; an input takes effect one dead time after its `time`.

        Raises:
            InvalidQuaternionError: the attitude is not a unit quaternion.
            TiltedTooFarError: the tilt exceeds 78° now, or at `end_time`.
        """
        motion = motion_of(vehicle)
        time = vehicle.time
        conditions = conditions_of(vehicle)
        constants = list(self._model.constants_of(conditions, motion))
        effective_inputs = [each for each in inputs if self._effect_time(each) <= time]
        (current_input,) = (
            effective_inputs[-1:] or inputs[:1] or [self._holding_input(time, motion)]
        )
        for next_input in [each for each in inputs if time < self._effect_time(each) < end_time]:
            duration = self._effect_time(next_input) - time
            motion = self._integrate(motion, current_input, duration, constants)
            time, current_input = self._effect_time(next_input), next_input
        motion = self._integrate(motion, current_input, end_time - time, constants)
        if hypot(motion.north, motion.east) > _LONGEST_COEFFICIENTS:
            raise TiltedTooFarError
        return motion

    def _effect_time(self, command: ControlInput) -> float:
        return command.time + self._settings.dead_time

    def _holding_input(self, time: float, motion: Motion) -> ControlInput:
        """The control input that holds the attitude and the vertical speed."""
        cos_tilt = (1.0 - motion.north**2 - motion.east**2) ** 0.5
        thrust = self._settings.gravity / cos_tilt
        return ControlInput(time, motion.north, motion.east, motion.heading, thrust)

    def _integrate(
        self, motion: Motion, current_input: ControlInput, duration: float, constants: list[float]
    ) -> Motion:
        """The motion `duration` seconds later, with the control input `current_input` in effect."""
        heading = motion.heading + wrap_angle(current_input.heading - motion.heading)
        # The planner shortens a target that exceeds its tilt limit.
        length = hypot(current_input.north, current_input.east)
        scale = min(1.0, sin(self._settings.max_tilt) / max(length, 1e-9))
        control = (
            scale * current_input.north,
            scale * current_input.east,
            heading,
            current_input.thrust,
        )
        steps = int(duration / _LONGEST_STEP) + 1
        for _ in range(steps):
            next_state = self._advance(motion, control, constants, duration / steps)
            motion = Motion(*(float(value) for value in next_state.elements()))
        return motion
