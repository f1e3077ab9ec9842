"""Every planner chosen as a user chooses it, in the YAML, and flown whole against the mock."""

import math

import pytest
from pymavlink import mavutil

from companion.attitude import (
    LAW_NAMES,
    Coefficients,
    Limits,
    Target,
    attitude,
    make_planner,
)
from companion.config_file import load
from companion.flight import assembly
from tests.flight.fly import fly, mock_vehicle

MAX_TILT_RATE, MAX_YAW_RATE = 90.0, 60.0  # °/s, the defaults of `limits`


@pytest.fixture(scope="module", params=LAW_NAMES)
def flown(request, tmp_path_factory):
    """Its name, and the summary of steps north, east and along a diagonal."""
    folder = tmp_path_factory.mktemp("flight")
    with mock_vehicle(folder, seed=3) as mock:
        changes = {"planner": {"name": request.param}, "flight": {"programme": ["steps"]}}
        summary = fly(mock, folder / "log", **changes)
        assert not mock.state()["crashed"]
    return request.param, summary


def test_it_flies_lands_and_disarms(flown):
    _, summary = flown
    assert summary.result == "ok", summary.events
    assert summary.phase == "disarm"
    assert summary.counts.setpoints == summary.counts.samples > 5000
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
    log = mavutil.mavlink_connection(str(summary.log / "flight.tlog"))
    asked = []
    while (message := log.recv_match(type="SET_ATTITUDE_TARGET")) is not None:
        rates = message.body_roll_rate, message.body_pitch_rate, message.body_yaw_rate
        asked.append((math.degrees(math.hypot(*rates[:2])), abs(math.degrees(rates[2]))))
    assert len(asked) == summary.counts.setpoints
    tilt_rates, yaw_rates = zip(*asked, strict=True)
    assert 30.0 < max(tilt_rates) <= MAX_TILT_RATE * (1.0 + 1e-6)  # the wire is single precision
    assert max(yaw_rates) <= MAX_YAW_RATE * (1.0 + 1e-6)


def cross_axis(folder, name):
    """The largest movement across the steps of `corners`, flown with PX4's measured response."""
    vehicle = {"lag_ms": 47, "dead_time_ms": 40, "yaw_lag_ms": 370, "yaw_dead_time_ms": 102}
    with mock_vehicle(folder, seed=3) as mock:
        summary = fly(
            mock,
            folder / "log",
            planner={"name": name},
            vehicle=vehicle,
            flight={"programme": ["corners"], "takeoff_height_m": 5.0},
        )
    assert summary.result == "ok", summary.events
    return summary.response().cross_axis_max


def test_model_following_is_the_straightest_on_a_real_rate_loop(tmp_path):
    across = {}
    for name in ("model-following", "first-order", "quaternion"):
        (tmp_path / name).mkdir()
        across[name] = cross_axis(tmp_path / name, name)
    assert across["model-following"] < across["first-order"] / 4
    assert across["model-following"] < across["quaternion"] / 3


def test_the_yaml_gives_model_following_the_vehicles_response(tmp_path):
    path = tmp_path / "vehicle.yaml"
    path.write_text(
        "planner: {name: model-following}\n"
        "vehicle: {lag_ms: 30, dead_time_ms: 45, yaw_lag_ms: 90}\n"
    )
    q = attitude(Coefficients(0.1, 0.2), 0.3)
    target = Target(0.3, -0.1, 0.5)
    limits = Limits(*(math.radians(angle) for angle in (35, 90, 60)))
    expected = make_planner(
        "model-following", limits=limits, lag=0.03, dead_time=0.045, yaw_lag=0.09
    )
    assert assembly.planner(load(path)).rates(q, target, 0.01) == expected.rates(q, target, 0.01)


@pytest.mark.parametrize("name", LAW_NAMES)
def test_the_yaml_makes_the_planner_it_names(name, tmp_path):
    path = tmp_path / "vehicle.yaml"
    path.write_text(
        f"planner: {{name: {name}, gain_per_s: 4.0, yaw_gain_per_s: 1.5}}\n"
        "limits: {max_tilt_deg: 40, max_tilt_rate_deg_s: 80, max_yaw_rate_deg_s: 50,\n"
        "  rate_limit: paper, recovery_angle_deg: 70}\n"
    )
    planner = assembly.planner(load(path))
    limits = Limits(*(math.radians(angle) for angle in (40, 80, 50)), shape="paper")
    expected = make_planner(name, 4.0, 1.5, limits, recovery_angle=math.radians(70))
    assert planner.law is expected.law
    assert planner.constants == expected.constants
