"""Steps compiled by numba against the same steps in Python: equal to the bit."""

import random
import sys
from math import inf, nan

import pytest

from companion.batch import can_compile
from companion.extras import MissingExtraError
from companion.testing import MockVehicle
from sitl_mock.config.airframe import AirframeConfig, WindConfig
from sitl_mock.config.rate_loop import RateLoopConfig
from sitl_mock.config.sensors import SensorConfig
from sitl_mock.physics.vehicle import ActuatorCommand, Vehicle
from sitl_mock.physics.vehicle_step import PythonPlant

needs_numba = pytest.mark.skipif(not can_compile(), reason="needs numba")
ODD = (nan, inf, -inf, 0.0)


def vehicle(rng, plant):
    """Any vehicle; some of its constants differ from all defaults."""
    shaped = rng.random() < 0.5
    return Vehicle(
        AirframeConfig(
            mass_kg=rng.uniform(0.8, 1.3),
            inertia_kg_m2=tuple(rng.uniform(0.02, 0.04) for _ in range(3)),
            quadratic_drag_n_s2_per_m2=rng.choice((0.0, 0.05)),
            axis_drag_n_s2_per_m2=rng.choice(((0.0, 0.0, 0.0), (0.05, 0.04, 0.06))),
            momentum_drag_n_s_per_m=rng.choice(((0.0, 0.0, 0.0), (0.3, 0.2, 0.1))),
            crash_tilt_deg=rng.choice((5.0, 180.0)),
            crash_speed_m_s=rng.choice((1.0, 100.0)),
            physics_rate_hz=rng.choice((1000, 2000)),
        ),
        RateLoopConfig.ardupilot() if shaped else RateLoopConfig(),
        WindConfig(speed_m_s=rng.uniform(0.0, 8.0), gust_m_s=1.0, vertical_gust_m_s=0.5),
        sensors=SensorConfig(ekf=rng.choice(("px4", "ardupilot", "none"))),
        seed=rng.randrange(1000),
        heading=rng.uniform(-3.0, 3.0),
        plant=plant,
    )


def command(rng):
    """Any command: most lift the vehicle, some let it fall, a few are no numbers."""
    rates = [rng.gauss(0.0, 1.5) if rng.random() < 0.95 else rng.choice(ODD) for _ in range(3)]
    thrust = rng.choice((0.0, 0.3, 0.55, 0.7, 1.2)) if rng.random() < 0.97 else rng.choice(ODD)
    return ActuatorCommand(rng.random() < 0.95, *rates, thrust)


def history(seed, plant):
    """What the vehicle was at 120 times, as text: it shows each bit, and NaN equals NaN."""
    rng = random.Random(seed)
    flown, rows, seen = vehicle(rng, plant), [], set()
    for _ in range(120):
        flown.step(command(rng), rng.randrange(1, 60))
        rows.append(repr((flown.truth, flown.estimate(), flown.attitude_target, flown.battery)))
        seen.add((flown.on_ground, flown.crashed))
    return rows, seen


@needs_numba
def test_any_flight_is_the_same_to_the_bit():
    from sitl_mock.physics.compiled import CompiledPlant  # noqa: PLC0415

    seen = set()
    for seed in range(16):
        rows, situations = history(seed, PythonPlant)
        assert history(seed, CompiledPlant) == (rows, situations), f"seed {seed}"
        seen |= situations
    assert seen == {(False, False), (True, False), (True, True)}


def test_without_numba_it_says_what_is_missing(monkeypatch):
    monkeypatch.setitem(sys.modules, "numba", None)
    with pytest.raises(MissingExtraError, match=r"a compiled mock vehicle needs numba.*\[study\]"):
        MockVehicle(compiled=True)
