"""Flies a planner with the complete inner loop (the paper's figure 5): the mock vehicle's physics.

The planner commands the mock's multirotor: a PI rate loop with feedforward and saturation, rotor
lag, aerodynamic damping, and a rigid body with gyroscopic torque. There are no sensors: the planner
gets the true attitude, so every deviation from the ideal response comes from the inner loop.
"""

from collections import deque
from dataclasses import dataclass, field
from math import exp

import numpy as np

from companion.attitude import BodyRates, Planner, Quaternion, Target, make_planner
from companion.attitude.kinematics import cos_tilt
from companion.attitude.limits import Constants
from companion.attitude.representation import normalised
from companion.guidance.thrust import specific_thrust
from companion.study.step import LoopFlight
from sitl_mock.config.airframe import AirframeConfig
from sitl_mock.config.rate_loop import RateLoopConfig
from sitl_mock.physics.multirotor import Multirotor

LEVEL: Quaternion = (1.0, 0.0, 0.0, 0.0)
ROLL_STEP = BodyRates(0.5, 0.0, 0.0)
"""Step of the rate setpoint with which the rate loop is measured, rad/s."""
ROLL_STEP_S = 0.25
"""Duration of the simulated response to `ROLL_STEP`, s."""


@dataclass(frozen=True)
class InnerLoop:
    """Rate loop, rotors and rigid body between commanded body rates and attitude."""

    airframe: AirframeConfig = field(default_factory=AirframeConfig)
    """Body and rotors; by default those of PX4's simulated quadrotor."""
    rate_loop: RateLoopConfig = field(default_factory=RateLoopConfig)
    """The body-rate controller; by default tuned to the measured response of PX4."""
    transport_delay: float = 0.0
    """Delay of every setpoint (rates and thrust) before it reaches the rate loop, s, rounded to a
    physics step."""

    def fly(
        self, planner: Planner, start: Quaternion, target: Target, *, seconds: float, rate_hz: float
    ) -> LoopFlight:
        """Fly from rest to a target; commanded rates are held until the next planner sample.

        The thrust holds the height at the tilt of each sample (`specific_thrust`, as in flight).
        Thrust does not affect the acceleration coefficients directly, but it affects the torque at
        which the rotors saturate.

        Args:
            planner: any planner of `companion.attitude`; it is not reset.
            start: attitude at the start; the vehicle is at rest, and the rotors turn steadily.
            target: target for the whole flight.
            seconds: duration of the flight, rounded to a sample.
            rate_hz: samples of the planner per second; must divide the physics rate.

        Raises:
            InvalidQuaternionError: `start` is not a unit quaternion.
            InvalidTargetError: `target` is not finite, or far too large.
        """
        physics_steps = round(self.airframe.physics_rate_hz / rate_hz)
        q = normalised(start)
        multirotor = Multirotor(self.airframe, self.rate_loop, q, _thrust_to_hold_height(q))
        setpoints = self._setpoint_queue(multirotor.throttle(_thrust_to_hold_height(q)))
        attitudes, body_rates, commanded_rates = [q], [multirotor.body_rates], []
        for _ in range(round(seconds * rate_hz)):
            rates = planner.rates(q, target, 1.0 / rate_hz, BodyRates(*multirotor.body_rates))
            setpoint = rates, multirotor.throttle(_thrust_to_hold_height(q))
            for _ in range(physics_steps):
                setpoints.append(setpoint)
                multirotor.move(multirotor.drive(*setpoints[0]))
            q = multirotor.q
            attitudes.append(q)
            body_rates.append(multirotor.body_rates)
            commanded_rates.append(rates)
        return LoopFlight(np.array(attitudes), np.array(commanded_rates), np.array(body_rates))

    def rate_time_to_63_percent(self) -> float:
        """Time until the roll rate reaches 1 − 1/e (63 %) of a step of its setpoint in hover, s.

        The time includes all delays, and can be compared with 1/p of a planner with gain p. The
        time must be shorter than `ROLL_STEP_S`.
        """
        target_rate = ROLL_STEP.roll * (1.0 - exp(-1.0))
        flight = self.fly(
            make_planner(_roll_step),
            LEVEL,
            Target(0.0, 0.0, 0.0),
            seconds=ROLL_STEP_S,
            rate_hz=self.airframe.physics_rate_hz,
        )
        roll_rates = flight.body_rates[:, 0]
        crossing_index = int(np.argmax(roll_rates >= target_rate))
        bracket_indices = np.array([crossing_index - 1, crossing_index])
        return float(
            np.interp(
                target_rate,
                roll_rates[bracket_indices],
                bracket_indices / self.airframe.physics_rate_hz,
            )
        )

    def _setpoint_queue(self, throttle: float) -> deque[tuple[BodyRates, float]]:
        """Queue of the delayed setpoints (rates, throttle), newest last; at first all rates 0."""
        queue_length = 1 + round(self.transport_delay * self.airframe.physics_rate_hz)
        return deque([(BodyRates(0.0, 0.0, 0.0), throttle)] * queue_length, maxlen=queue_length)


def faster_inner_loop(speedup: int) -> InnerLoop:
    """The default inner loop with all of its times divided by `speedup`.

    Inertia and rotor lag are divided by `speedup`, and the torques are the same. So the body rates
    follow a command in the same way, `speedup` times faster, except for the gyroscopic torque. The
    physics rate is multiplied by `speedup`.
    """
    airframe, rate_loop = AirframeConfig(), RateLoopConfig()
    scaled_airframe = {
        "physics_rate_hz": speedup * airframe.physics_rate_hz,
        "inertia_kg_m2": tuple(inertia / speedup for inertia in airframe.inertia_kg_m2),
        "rotor_lag_ms": airframe.rotor_lag_ms / speedup,
    }
    scaled_axes = {
        name: axis.model_copy(
            update={
                "integral_n_m": speedup * axis.integral_n_m,
                "damping_n_m_s2": axis.damping_n_m_s2 / speedup,
                "torque_filter_ms": axis.torque_filter_ms / speedup,
                "setpoint_delay_ms": axis.setpoint_delay_ms / speedup,
            }
        )
        for name, axis in rate_loop
    }
    return InnerLoop(
        AirframeConfig(**{**airframe.model_dump(), **scaled_airframe}),
        RateLoopConfig(**scaled_axes),
    )


def _roll_step(q: Quaternion, target: Target, dt: float, constants: Constants) -> BodyRates:
    """A law that always commands `ROLL_STEP`."""
    return ROLL_STEP


def _thrust_to_hold_height(q: Quaternion) -> float:
    """Specific thrust that holds height at this attitude, m/s²."""
    return specific_thrust(0.0, cos_tilt(q[1], q[2]))
