"""A planner flown with the complete inner loop (the paper's figure 5), in the judge's own physics.

The mock's multirotor is what the planner commands: rate loop with PI, feed-forward and saturation,
rotor lag, aerodynamic damping, and a rigid body with its gyroscopic torque. There are no sensors:
the planner sees the true attitude, so that what differs from the ideal is the inner loop's doing.
"""

from collections import deque
from dataclasses import dataclass, field
from math import exp, isclose, isfinite

import numpy as np
from numpy.typing import NDArray

from companion.attitude import BodyRates, Planner, Quaternion, Target
from companion.attitude.kinematics import cos_tilt
from companion.attitude.representation import normalised
from companion.guidance.thrust import specific_thrust
from sitl_mock.config.airframe import AirframeConfig
from sitl_mock.config.rate_loop import RateLoopConfig
from sitl_mock.physics.multirotor import Multirotor

LEVEL: Quaternion = (1.0, 0.0, 0.0, 0.0)
ROLL_STEP = BodyRates(0.5, 0.0, 0.0)
"""Step of the setpoint that measures the rate loop, rad/s; it tilts by 57° in its 2 s."""


@dataclass(frozen=True, slots=True)
class InnerLoopFlight:
    """One flight of n samples of the planner. Rates are of the body (FRD), rad/s.

    Attributes:
        time: (n+1,), s from the start.
        q: (n+1, 4), attitude (w, x, y, z), body → world (NED).
        body_rates: (n+1, 3), how the vehicle really turns.
        commanded: (n, 3), the rates asked at each sample, before any delay.
        tilt_saturated: (n,), whether the rotors fell short of the roll and pitch torque asked of
            them, at any physics step of the sample.
        yaw_saturated: (n,), the same for the yaw torque.
    """

    time: NDArray[np.float64]
    q: NDArray[np.float64]
    body_rates: NDArray[np.float64]
    commanded: NDArray[np.float64]
    tilt_saturated: NDArray[np.bool_]
    yaw_saturated: NDArray[np.bool_]


@dataclass(frozen=True)
class InnerLoop:
    """What lies between the body rates a planner asks for and the attitude it sees.

    Attributes:
        airframe: body and rotors; by default those of PX4's simulated quadrotor.
        rate_loop: the body-rate controller; by default tuned to PX4's measured response.
        transport_delay: of every setpoint (rates and thrust) on top of the rate loop's own delay,
            s, to the nearest physics step.

    Raises:
        ValueError: `transport_delay` is negative or not finite.
    """

    airframe: AirframeConfig = field(default_factory=AirframeConfig)
    rate_loop: RateLoopConfig = field(default_factory=RateLoopConfig)
    transport_delay: float = 0.0

    def __post_init__(self) -> None:
        if not (isfinite(self.transport_delay) and self.transport_delay >= 0.0):
            raise ValueError(
                f"transport_delay must be finite and not negative, not {self.transport_delay}"
            )

    def fly(
        self, planner: Planner, start: Quaternion, target: Target, *, seconds: float, rate_hz: float
    ) -> InnerLoopFlight:
        """Fly one target from rest, the planner's rates held from one of its samples to the next.

        The collective holds height at the tilt of each sample, by the flight's own
        `specific_thrust`. The coefficients do not depend on it, but the torque the rotors can give
        before they saturate does, and in a tilt a hover thrust would misjudge it.

        Args:
            planner: any of `companion.attitude`; it is not reset.
            start: attitude at the start, at rest, the rotors turning steadily.
            target: held throughout.
            seconds: length of the flight, to the nearest sample.
            rate_hz: samples of the planner per second; must divide the physics rate.

        Raises:
            InvalidQuaternionError: `start` is not a unit quaternion.
            InvalidTargetError: `target` is not finite.
            ValueError: `rate_hz` does not divide the physics rate, or no sample fits `seconds`.
        """
        physics_steps = self._physics_steps(rate_hz)
        samples = round(seconds * rate_hz) if isfinite(seconds) else 0
        if samples < 1:
            raise ValueError(f"seconds must hold one sample at least, not {seconds}")
        q = normalised(start)
        multirotor = Multirotor(self.airframe, self.rate_loop, q, _thrust(q))
        setpoints = self._awaiting_mode(multirotor.throttle(_thrust(q)))
        attitudes, turning, commanded, saturated = [q], [multirotor.body_rates], [], []
        for _ in range(samples):
            rates = planner.rates(q, target, 1.0 / rate_hz, BodyRates(*multirotor.body_rates))
            setpoint = rates, multirotor.throttle(_thrust(q))
            tilt_saturated = yaw_saturated = False
            for _ in range(physics_steps):
                setpoints.append(setpoint)
                multirotor.move(multirotor.drive(*setpoints[0]))
                tilt_saturated |= multirotor.mix.tilt_saturated
                yaw_saturated |= multirotor.mix.yaw_saturated
            q = multirotor.q
            attitudes.append(q)
            turning.append(multirotor.body_rates)
            commanded.append(rates)
            saturated.append((tilt_saturated, yaw_saturated))
        return InnerLoopFlight(
            np.arange(samples + 1) / rate_hz,
            np.array(attitudes),
            np.array(turning),
            np.array(commanded),
            *np.array(saturated).T,
        )

    def rate_step_63(self) -> float:
        """Seconds until the roll rate has made 1 − 1/e (63 %) of a step of its setpoint, in hover.

        It counts every delay, and so is the time to hold against the 1/p of a planner.

        Raises:
            ValueError: the roll rate does not get there in 2 s.
        """
        flight = self.fly(
            _Constant(ROLL_STEP),
            LEVEL,
            Target(0.0, 0.0, 0.0),
            seconds=2.0,
            rate_hz=self.airframe.physics_rate_hz,
        )
        goal = ROLL_STEP.roll * (1.0 - exp(-1.0))
        roll = flight.body_rates[:, 0]
        after = int(np.argmax(roll >= goal))
        if after == 0:
            raise ValueError(
                f"the roll rate gets to {roll.max():.3g} of {ROLL_STEP.roll} rad/s only"
            )
        between = slice(after - 1, after + 1)
        return float(np.interp(goal, roll[between], flight.time[between]))

    def _physics_steps(self, rate_hz: float) -> int:
        """Physics steps of one sample."""
        physics_hz = self.airframe.physics_rate_hz
        steps = round(physics_hz / rate_hz) if rate_hz > 0.0 else 0
        if not isclose(steps * rate_hz, physics_hz):
            raise ValueError(
                f"the planner's rate must divide the physics rate of {physics_hz} Hz, "
                f"not {rate_hz} Hz"
            )
        return steps

    def _awaiting_mode(self, throttle: float) -> deque[tuple[BodyRates, float]]:
        """The setpoints under way, newest last: at the start no rates and this throttle."""
        length = 1 + round(self.transport_delay * self.airframe.physics_rate_hz)
        return deque([(BodyRates(0.0, 0.0, 0.0), throttle)] * length, maxlen=length)


def quickened(factor: int) -> InnerLoop:
    """The default inner loop with every one of its times divided by `factor`, nothing else changed.

    A smaller vehicle: inertia and rotor lag shrink, the torques stay, and so the response in the
    scaled time is the same. Its physics run `factor` times as often.
    """
    airframe, rate_loop = AirframeConfig(), RateLoopConfig()
    shrunk = {
        "physics_rate_hz": factor * airframe.physics_rate_hz,
        "inertia_kg_m2": tuple(inertia / factor for inertia in airframe.inertia_kg_m2),
        "rotor_lag_ms": airframe.rotor_lag_ms / factor,
    }
    axes = {
        name: axis.model_copy(
            update={
                "integral_n_m": factor * axis.integral_n_m,
                "damping_n_m_s2": axis.damping_n_m_s2 / factor,
                "torque_filter_ms": axis.torque_filter_ms / factor,
                "setpoint_delay_ms": axis.setpoint_delay_ms / factor,
            }
        )
        for name, axis in rate_loop
    }
    return InnerLoop(AirframeConfig(**{**airframe.model_dump(), **shrunk}), RateLoopConfig(**axes))


class _Constant:
    """A planner that asks for the same rates, whatever the attitude."""

    def __init__(self, rates: BodyRates) -> None:
        self._rates = rates

    def rates(
        self, q: Quaternion, target: Target, dt: float, body_rates: BodyRates | None = None
    ) -> BodyRates:
        """The constant rates."""
        return self._rates

    def note_attitude_target(self, q: Quaternion, age: float) -> None:
        """Whatever the axes."""

    def reset(self, q: Quaternion, body_rates: BodyRates | None = None) -> None:
        """Nothing to forget."""


def _thrust(q: Quaternion) -> float:
    """Specific thrust that holds height at this attitude, m/s²."""
    return specific_thrust(0.0, cos_tilt(q[1], q[2]))
