"""The closed position loop on one axis: our own code around a simple simulated vehicle.

The vehicle rolls as it is told after a dead time and a lag, and is pulled east by its tilt. What
the program believes of it is the configuration's; what it is may differ.
"""

from collections import deque
from math import cos, exp, sin, tan
from typing import NamedTuple

import numpy as np
from scipy.linalg import expm

from companion.attitude import BodyRates
from companion.config import Config
from companion.control.guidance_command import GuidanceCommand
from companion.control.inner_loop import planner
from companion.control.outer_loop import make_guidance, motion_estimate
from companion.guidance import GRAVITY, Reference
from companion.vehicle.records import AttitudeSample, LocalPosition

DT = 0.004
_GUIDANCE, _POSITION, _POSITION_LATE = 5, 5, 3
"""Steps between commands, between positions, and delay of positions: 50 Hz, 50 Hz, 12 ms."""


class Airframe(NamedTuple):
    """The true vehicle: s, s, 1/s.

    `strength` multiplies the acceleration by tilt, `rate_gain` the commanded body rate. A `damping`
    makes the lag one of second order, 2ζ/ω.
    """

    lag: float
    dead_time: float
    drag: float = 0.5
    strength: float = 1.0
    rate_gain: float = 1.0
    damping: float | None = None


def rate_loop(vehicle: Airframe):
    """Transition matrix of (rate, slope) over DT, and what a unit command adds."""
    if vehicle.damping is None:
        kept = exp(-DT / vehicle.lag)
        return np.diag([kept, 0.0]), np.array([1.0 - kept, 0.0])
    square = (0.5 * vehicle.lag / vehicle.damping) ** 2
    moves = np.array([[0.0, 1.0], [-1.0 / square, -vehicle.lag / square]])
    kept = expm(DT * moves)
    return kept, np.array([1.0, 0.0]) - kept[:, 0]


def hold(config: Config, vehicle: Airframe, seconds=12.0, off=0.5, noise=(0.0, 0.0), seed=0):
    """(S,) east position in m while 0 is held, begun at rest `off` away; NaN once it has toppled.

    Args:
        config: as it is flown.
        vehicle: as it is.
        seconds: how long.
        off: m.
        noise: standard deviation of the measured position (m) and velocity (m/s), white.
        seed: of the noise.
    """
    rng, law, guidance = np.random.default_rng(seed), planner(config), make_guidance(config)
    estimate = motion_estimate(config, lambda: 0.0)
    late = round(vehicle.dead_time / DT)
    asked = deque([0.0] * (late + 1), maxlen=late + 1)
    (kept, added), turning = rate_loop(vehicle), np.zeros(2)
    told = deque(maxlen=_POSITION_LATE + 1)
    roll = rate = place = speed = 0.0
    command, places = None, np.full(round(seconds / DT), np.nan)
    place = off
    for n in range(len(places)):
        time = n * DT
        q = (cos(0.5 * roll), sin(0.5 * roll), 0.0, 0.0)
        rates = BodyRates(rate, 0.0, 0.0)
        estimate.note_attitude(AttitudeSample(0, time, time, 0, q, rates))
        told.append((time, place, speed))
        if n % _POSITION == 0:
            at, east, fast = told[0]
            east, fast = east + noise[0] * rng.normal(), fast + noise[1] * rng.normal()
            position = LocalPosition(time, at, (0.0, east, -5.0), (0.0, fast, 0.0))
            estimate.note_position(position, offboard_active=True)
        if n % _GUIDANCE == 0:
            inputs = estimate.guidance_input(time, guidance.effect_delay, (2.0, 18.0))
            held = Reference((0.0, 0.0, -5.0))
            target, later, down = guidance.command(lambda _, held=held: held, time, inputs)
            command = GuidanceCommand(target, down, time, later_target=later, period=_GUIDANCE * DT)
        asked.append(vehicle.rate_gain * law.rates(q, command.target_at(time), DT, rates).roll)
        turning = kept @ turning + added * asked[0]
        rate = float(turning[0])
        roll += DT * rate
        if abs(roll) > 1.2:
            return places
        speed += DT * (vehicle.strength * GRAVITY * tan(roll) - vehicle.drag * speed)
        place += DT * speed
        places[n] = place
    return places


def settled(places: np.ndarray, off: float) -> bool:
    """Whether the last quarter stays within a tenth of `off`: no oscillation, no divergence."""
    last = len(places) // 4
    return bool(np.isfinite(places).all() and np.abs(places[-last:]).max() < 0.1 * off)
