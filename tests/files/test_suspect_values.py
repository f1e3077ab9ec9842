"""Values that are allowed and most likely not meant."""

import pytest

from companion.cli.main import main
from companion.config import Config
from companion.config.files import load, shipped
from companion.config.suspect_values import suspect_values

MOCK = {"mock": {}}


@pytest.mark.parametrize(
    ("section", "key", "value", "meant"),
    [
        ("limits", "max_yaw_rate_deg_s", 1.57, "89.95"),
        ("limits", "max_yaw_rate_deg_s", 1.05, "60.16"),
        ("limits", "min_battery_percent", 0.4, "40"),
        ("vehicle", "lag_ms", 0.047, "47"),
        ("vehicle", "acceleration_limit_deg_s2", 19.2, "1100"),
        ("thrust", "lag_ms", 0.05, "50"),
    ],
)
def test_a_value_in_another_unit_is_doubted(section, key, value, meant):
    (doubt,) = suspect_values(Config.model_validate({**MOCK, section: {key: value}}))
    assert doubt.key == f"{section}.{key}"
    assert f"{value:g}" in doubt.description
    assert doubt.fix == f"write {meant} if that was meant"


def test_no_shipped_value_is_doubted():
    for name in ("px4", "ardupilot", "mock-px4", "mock-ardupilot"):
        found = {doubt.key for doubt in suspect_values(load(shipped(f"{name}.yaml")))}
        assert found == (set() if "mock" in name else {"vehicle.identified"})


def test_times_that_identify_wrote_are_the_vehicles_own():
    times = {"lag_ms": 47.0, "dead_time_ms": 40.0}
    assert [doubt.key for doubt in suspect_values(Config.model_validate({"vehicle": times}))] == [
        "vehicle.identified"
    ]
    own = {"vehicle": {**times, "identified": "2026-11-22T10-54-16Z"}}
    assert list(suspect_values(Config.model_validate(own))) == []
    assert list(suspect_values(Config())) == []


def test_a_key_of_ones_own_beside_identified_times_takes_the_mark_away(tmp_path):
    (tmp_path / "own.yaml").write_text(
        "vehicle: {identified: a flight, lag_ms: 40, dead_time_ms: 30}\n"
    )
    path = tmp_path / "c.yaml"
    for text, mark in (("", "a flight"), ("vehicle: {lag_ms: 47}\n", None)):
        path.write_text(f"include: own.yaml\n{text}")
        assert load(path).vehicle.identified == mark


def test_check_config_says_what_to_expect_and_what_to_look_at_again(tmp_path, capsys):
    path = tmp_path / "c.yaml"
    path.write_text("vehicle: {lag_ms: 47, dead_time_ms: 40}\nplanner: {gain_per_s: 10}\n")
    assert main(["check-config", str(path)]) == 0
    out = capsys.readouterr().out
    assert (
        "expected to have a time constant of 0.29 s\n  limits.max_tilt_rate_deg_s lengthens" in out
    )
    assert "5.2 is the largest sensible one" in out
    assert "the hold has gains of " in out
    assert (
        "warning: vehicle.lag_ms and vehicle.dead_time_ms were not measured on this vehicle" in out
    )
    assert out.endswith(f"{path}: ok\n")


def test_a_limit_of_body_rates_below_the_commanded_ones_is_doubted():
    def doubted(limit):
        return list(
            suspect_values(
                Config.model_validate({**MOCK, "safety": {"max_body_rate_deg_s": limit}})
            )
        )

    (doubt,) = doubted(108.0)  # √(90² + 60²) = 108.2
    assert doubt.key == "safety.max_body_rate_deg_s"
    assert "the planner may command 108 °/s" in doubt.sentence()
    assert doubted(109.0) == []


@pytest.mark.parametrize(
    ("flight", "doubted"),
    [
        ({"takeoff_height_m": 53.0}, []),
        ({"takeoff_height_m": 56.0}, ["flight.takeoff_timeout_s"]),
        ({"takeoff_height_m": 56.0, "take_over": True}, []),
        ({"landing_timeout_s": 9.0}, ["flight.landing_timeout_s"]),
        ({"landing_timeout_s": 11.0}, []),
        ({"takeoff_height_m": 25.0, "landing_timeout_s": 29.0}, ["flight.landing_timeout_s"]),
        ({"takeoff_height_m": 25.0, "landing_timeout_s": 31.0}, []),
    ],
)
def test_times_that_are_too_short_for_the_height_are_doubted(flight, doubted):
    """They were found in the air: the vehicle was landed on its way up."""
    found = suspect_values(Config.model_validate({"flight": flight}))
    assert [doubt.key for doubt in found] == doubted
