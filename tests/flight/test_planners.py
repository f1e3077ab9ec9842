"""Every planner chosen as a user chooses it, in the YAML, and flown whole against the mock."""

import asyncio
import math
from contextlib import ExitStack
from pathlib import Path

import pytest
import yaml

from companion.attitude import (
    LAW_NAMES,
    BodyRates,
    Coefficients,
    Limits,
    Target,
    attitude,
    make_planner,
)
from companion.config.files import load
from companion.control import inner_loop
from companion.mavlink import loop
from tests.flight import sockets, tlog
from tests.flight.fly import fly, mock_vehicle

CONFIGS = Path(__file__).parents[2] / "configs"

MAX_TILT_RATE, MAX_YAW_RATE = 90.0, 60.0  # °/s, the defaults of `limits`

NO_NOISE = {
    "ekf": "none",
    "attitude_noise_deg": 0.0,
    "rate_noise_rad_s": 0.0,
    "position_noise_m": 0.0,
    "velocity_noise_m_s": 0.0,
}
"""With noise the motion in which a hover ends bends a step by 0.002 to 0.006, by its seed."""


@pytest.fixture(
    scope="module",
    params=[
        pytest.param(name, marks=pytest.mark.slow) if name in ("exact", "so3", "euler") else name
        for name in LAW_NAMES  # exact flies as first-order does, so3 and euler as quaternion
    ],
)
def flown(request, tmp_path_factory):
    """Its name, and the summary of steps north, east and along a diagonal."""
    folder = tmp_path_factory.mktemp("flight")
    with mock_vehicle(folder, sensors=NO_NOISE) as mock:
        changes = {
            "planner": {"name": request.param},
            "flight": {"maneuvers": ["steps"]},
            "steps": {"duration_s": 0.8, "settle_s": 1.0},
        }
        summary = fly(mock, folder / "log", **changes)
        assert not mock.state()["crashed"]
    return request.param, summary


def test_it_flies_lands_and_disarms(flown):
    _, summary = flown
    assert summary.result == "ok", summary.events
    assert summary.phase == "disarm"
    assert summary.counts.setpoints == summary.counts.samples > 1600
    assert summary.tracking()["height_rms_m"] < 0.05


def test_its_steps_through_level_are_straight_with_the_rate_loops_lag(flown):
    """A step through level is the one case in which the paper's other methods are straight, too."""
    name, summary = flown
    response = summary.response()
    assert response.time_constant_north_s == pytest.approx(0.26, abs=0.01)
    assert response.time_constant_east_s == pytest.approx(0.26, abs=0.01)
    assert response.cross_axis_max < (0.01 if name == "euler" else 0.003)


def test_every_setpoint_is_within_the_limits(flown):
    _, summary = flown
    asked = []
    for message in tlog.messages(summary, "SET_ATTITUDE_TARGET"):
        rates = message.body_roll_rate, message.body_pitch_rate, message.body_yaw_rate
        asked.append((math.degrees(math.hypot(*rates[:2])), abs(math.degrees(rates[2]))))
    assert len(asked) == summary.counts.setpoints
    tilt_rates, yaw_rates = zip(*asked, strict=True)
    assert 30.0 < max(tilt_rates) <= MAX_TILT_RATE * (1.0 + 1e-6)  # the wire is single precision
    assert max(yaw_rates) <= MAX_YAW_RATE * (1.0 + 1e-6)


FIGURE_2 = {
    "corners": {
        "north_coefficient": 0.4,
        "east_coefficient": 0.5,
        "duration_s": 1.2,
        "settle_s": 0.5,
    },
    "limits": {"max_tilt_deg": 45, "max_tilt_rate_deg_s": 400},
    "flight": {"maneuvers": ["corners"], "takeoff_height_m": 3.0},
}
"""The step of the paper's figure 2, at several heights of its rectangle, without its rate limit."""

SMALLER = {"north_coefficient": 0.3, "east_coefficient": 0.35, "duration_s": 1.2, "settle_s": 0.5}
"""Of a heavier vehicle, which has less thrust to spare."""


def shipped_vehicle(loop):
    """What the configuration that ships for it says of this rate loop."""
    return yaml.safe_load((CONFIGS / f"vehicle-{loop}.yaml").read_text())["vehicle"]


@pytest.mark.parametrize("loop", ["px4", pytest.param("ardupilot", marks=pytest.mark.slow)])
def test_model_following_is_five_times_as_straight_on_a_measured_rate_loop(loop):
    """By the flight's own table; and nearest to second order with a dead time."""
    across, away = {}, {}
    for name in ("model-following", "first-order", "quaternion"):
        with mock_vehicle(seed=3, rate_loop=loop) as mock:
            summary = fly(
                mock, None, planner={"name": name}, vehicle=shipped_vehicle(loop), **FIGURE_2
            )
        assert summary.result == "ok", summary.events
        response = summary.as_dict()["response"]
        across[name] = response["cross_axis_max"]
        away[name] = response["second_order"]["deviation_max"]
    assert across["model-following"] < 0.2 * across["first-order"]
    assert across["model-following"] < 0.2 * across["quaternion"]
    assert away["model-following"] < min(away["first-order"], away["quaternion"])


def test_model_following_leads_unlike_axes_each_by_its_own():
    """A heavier vehicle, slower in roll, flies straight; led by the mean of both it does not."""
    yaw = {"yaw_lag_ms": 370.0, "yaw_dead_time_ms": 102.0}
    pitch = {"pitch_lag_ms": 58.0, "pitch_dead_time_ms": 46.0}
    told = {
        "own": {"lag_ms": 75.0, "dead_time_ms": 51.0, **pitch, **yaw},
        "mean": {"lag_ms": 66.5, "dead_time_ms": 48.5, **yaw},
    }
    across = {}
    for name, vehicle in told.items():
        with mock_vehicle(seed=3, sensors=NO_NOISE, airframe="unlike-axes") as mock:
            summary = fly(
                mock,
                None,
                vehicle=vehicle,
                thrust={"hover_thrust": 0.59},
                **(FIGURE_2 | {"corners": SMALLER}),
            )
        assert summary.result == "ok", summary.events
        across[name] = summary.as_dict()["response"]["cross_axis_max"]
    assert across["own"] < 0.007
    assert across["mean"] > 1.8 * across["own"]


@pytest.mark.slow
def test_the_order_is_the_same_in_real_time(tmp_path):
    """Two vehicles flown at once, without lockstep."""
    names = ("model-following", "first-order")
    with ExitStack() as stack:
        sessions = []
        for name in names:
            folder = tmp_path / name
            folder.mkdir()
            mock = stack.enter_context(
                sockets.mock_vehicle(folder, in_lockstep=False, seed=3, speed=1.0, rate_loop="px4")
            )
            changes = {"planner": {"name": name}, "vehicle": shipped_vehicle("px4")}
            sessions.append(sockets.session_for(mock, folder / "log", **FIGURE_2, **changes))

        async def fly_all():
            return await asyncio.gather(*(session.fly() for session in sessions))

        followed, first_order = loop.run(fly_all())
    for summary in (followed, first_order):
        assert summary.result == "ok", summary.events
    assert followed.response().cross_axis_max < 0.3 * first_order.response().cross_axis_max


def test_the_yaml_gives_model_following_the_vehicles_response(tmp_path):
    path = tmp_path / "vehicle.yaml"
    path.write_text(
        "vehicle: {lag_ms: 30, dead_time_ms: 45, acceleration_limit_deg_s2: 900, yaw_lag_ms: 90,\n"
        "  pitch_lag_ms: 40, pitch_dead_time_ms: 25, pitch_acceleration_limit_deg_s2: 800,\n"
        "  yaw_acceleration_limit_deg_s2: 200, yaw_frame_lead_ms: 50}\n"
    )
    q, rates = attitude(Coefficients(0.1, 0.2), 0.3), BodyRates(0.0, 0.2, -0.4)
    target = Target(0.3, -0.1, 2.5)
    limits = Limits(*(math.radians(angle) for angle in (35, 90, 60)))
    expected = make_planner(
        "model-following",
        limits=limits,
        lag=0.03,
        dead_time=0.045,
        acceleration=math.radians(900),
        pitch_lag=0.04,
        pitch_dead_time=0.025,
        pitch_acceleration=math.radians(800),
        yaw_lag=0.09,
        yaw_acceleration=math.radians(200),
        frame_lead=0.05,
    )
    planner = inner_loop.planner(load(path))
    for _ in range(30):
        assert planner.rates(q, target, 0.01, rates) == expected.rates(q, target, 0.01, rates)


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("vehicle: {lag_ms: 30, dead_time_ms: 45}", "model-following"),
        ("vehicle: {lag_ms: 30}", "first-order"),
        ("{}", "first-order"),
        ("vehicle: {lag_ms: 30, dead_time_ms: 45}\nplanner: {name: so3}", "so3"),
    ],
)
def test_model_following_flies_where_the_vehicles_response_is_known(text, name, tmp_path):
    path = tmp_path / "vehicle.yaml"
    path.write_text(text)
    assert load(path).planner_name == name


@pytest.mark.parametrize("name", LAW_NAMES)
def test_the_yaml_makes_the_planner_it_names(name, tmp_path):
    path = tmp_path / "vehicle.yaml"
    path.write_text(
        f"planner: {{name: {name}, gain_per_s: 4.0, yaw_gain_per_s: 1.5}}\n"
        "limits: {max_tilt_deg: 40, max_tilt_rate_deg_s: 80, max_yaw_rate_deg_s: 50,\n"
        "  rate_limit: paper, recovery_angle_deg: 70}\n"
    )
    planner = inner_loop.planner(load(path))
    limits = Limits(*(math.radians(angle) for angle in (40, 80, 50)), shape="paper")
    expected = make_planner(name, 4.0, 1.5, limits, recovery_angle=math.radians(70))
    assert planner.law is expected.law
    assert planner.constants == expected.constants
