"""Our program ends at speed: how far the last rates carry the vehicle; the model bounds that.

The table of docs/exits.md: `python -m pytest tests/flight/test_killed.py -s` prints its rows.
"""

import asyncio
from math import dist, tau
from typing import NamedTuple

import pytest

from companion.config.known_drag import drag_before_connecting
from companion.flight.maneuvers import configured_maneuvers
from companion.preflight.offboard_loss import worst_reach
from tests.flight.fly import mock_vehicle, quick_flight, run, session_for
from tests.flight.others import When

HELD = {"px4": "COM_OF_LOSS_T", "ardupilot": "GUID_TIMEOUT"}
RADIUS = {2.0: 5.0, 5.0: 5.0, 8.0: 13.0, 10.0: 20.0}  # m by m/s: about 5 m/s² from 5 m/s on
SETTLED = {"px4": 6.0, "ardupilot": 15.0}
"""PX4 holds by then; ArduPilot drifts with less than 0.2 m/s, s."""
SPEEDS, TIMES, LATER = tuple(RADIUS), (0.5, 1.0, 2.0), (0.0, 1 / 16, 1 / 8)


class Carried(NamedTuple):
    """From where the setpoints ended, m."""

    away: float
    up: float
    down: float


def flight(autopilot, speed):
    """A circle, with limits that allow it, and no fence in its way."""
    return {
        "flight": {
            "maneuvers": ["circle"],
            "takeoff_height_m": 20.0,
            "takeoff_timeout_s": 60.0,
            "accept": [HELD[autopilot]],
        },
        "circle": {"radius_m": RADIUS[speed], "speed_m_s": speed, "laps": 3.0},
        "limits": {
            "max_tilt_deg": 58.0,
            "max_thrust": 1.0,
            "max_tilt_rate_deg_s": 180.0,
            "fence_radius_m": 200.0,
            "fence_ceiling_m": 100.0,
        },
        "deadman": {"silence_limit_ms": 300.0},
        "guidance": {"position_weight_per_s4": 150.0, "velocity_weight_per_s2": 20.0},
        "safety": {"max_tracking_error_m": 20.0, "max_speed_m_s": 30.0},
    }


def moments(speed):
    """Seconds into the circle: while it gathers speed, and round a quarter of the second lap.

    The vehicle answers roll as pitch, so a quarter stands for all.
    """
    lap = tau * RADIUS[speed] / speed
    return (0.5 * speed, *(speed + (0.5 + later) * lap for later in LATER))


def carried(autopilot, speed, held, after, *, full_rate):
    """One flight whose setpoints end `after` s of its circle; PX4 is set to hold afterwards."""
    settings = {HELD[autopilot]: held, **({"COM_OBL_RC_ACT": 5} if autopilot == "px4" else {})}
    with mock_vehicle(autopilot=autopilot, full_rate=full_rate, parameters=settings) as mock:
        session = None

        def end():
            mock.inject({"kind": "drop", "direction": "from_companion"})
            session.leave()

        def leave():
            asyncio.get_running_loop().call_later(after, end)

        observer = When("maneuvers", leave)
        changes = flight(autopilot, speed)
        session = session_for(mock, None, observer, **changes)
        assert run(mock, session.fly()).result == "stopped at once by the user"
        state = mock.state()
        ways, ended = [state["position"]], state["last_setpoint"]
        while state["time"] < ended + held + SETTLED[autopilot]:
            mock.step()
            state = mock.state()
            ways.append(state["position"])
        assert (state["last_setpoint"], state["crashed"]) == (ended, False)
    start = ways[0]
    return Carried(
        max(dist(way[:2], start[:2]) for way in ways),
        max(start[2] - way[2] for way in ways),
        max(way[2] - start[2] for way in ways),
    )


def worst(autopilot, speed, held, *, all_of_them):
    """The largest in each direction over the moments."""
    chosen = moments(speed) if all_of_them else moments(speed)[1:2]
    flights = [carried(autopilot, speed, held, after, full_rate=all_of_them) for after in chosen]
    return Carried(*map(max, zip(*flights, strict=True)))


def bound(autopilot, speed, held):
    """What the doctor's model says of the same flight."""
    config = quick_flight(autopilot, flight(autopilot, speed))
    drag = drag_before_connecting(config).lower_bound
    flown = configured_maneuvers(config)
    return worst_reach(config, flown, held, drag, brakes=autopilot == "px4")


def compare(measured, model):
    """Bounded, and not by a factor of ten; vertical ways of a few centimetres are noise."""
    assert measured.away <= model.largest_distance < 10.0 * measured.away
    assert measured.up <= model.climb + 0.2
    assert measured.down <= model.fall + 0.2
    assert model.fall < max(10.0 * measured.down, 10.0)


@pytest.mark.parametrize("autopilot", HELD)
def test_the_model_bounds_where_the_last_rates_carry_the_vehicle(autopilot):
    measured = worst(autopilot, 5.0, 1.0, all_of_them=False)
    assert measured.away > 5.0  # a second at 5 m/s, at least
    compare(measured, bound(autopilot, 5.0, 1.0))


@pytest.mark.slow
@pytest.mark.timeout(900)
@pytest.mark.parametrize("held", TIMES)
@pytest.mark.parametrize("autopilot", HELD)
def test_the_table_of_the_exits(autopilot, held):
    for speed in SPEEDS:
        measured = worst(autopilot, speed, held, all_of_them=True)
        model = bound(autopilot, speed, held)
        print(
            f"| {autopilot} | {held:g} | {speed:g} | {measured.away:.1f} | {measured.down:.1f} "
            f"| {model.largest_distance:.0f} | {model.fall:.0f} |"
        )
        compare(measured, model)
