"""What a campaign's file must not say: each is one sentence that names the place."""

import pytest

from tests.campaign.test_campaign_file import load, refusal

WIND = "mock.wind.speed_m_s"
SILENCE = {"inject": [{"kind": "stop_telemetry"}], "ends": ["held"]}


@pytest.mark.parametrize(
    ("told", "words"),
    [
        ("5", "must be a list of values, or a distribution"),
        ([[1, [2]], 3], "each value must be a number, a word, true, false, null or a list"),
        ([1.0, float("nan")], "finite"),
        ([1, 2, 1], "a value is listed twice"),
        ({"uniform": [0, 8], "normal": [4, 1]}, "give exactly one of"),
        ({"count": 3}, "give exactly one of"),
        ({"uniform": [8, 8]}, "uniform: the first value must be below the second"),
        ({"normal": [4, 1], "within": [6, 2]}, "within: the first value must be below"),
        ({"loguniform": [0, 8]}, "loguniform: both values must be above 0"),
        ({"normal": [4, 0]}, "normal: the standard deviation must be above 0"),
        ({"range": [0, 8]}, "range and count go together"),
        ({"uniform": [0, 8], "within": [1, 2]}, "`within` limits a normal distribution"),
        ({"values": ["a", "b"], "times_base": True}, "`times_base` multiplies the base value"),
    ],
)
def test_a_swept_key_that_is_none(tmp_path, told, words):
    said = refusal(tmp_path, sweep={WIND: told}, samples=2)
    assert words in said
    assert WIND in said


@pytest.mark.parametrize(
    ("told", "words"),
    [
        ({"sweep": {"fault.phase": ["maneuvers", "land"]}}, "sweep.fault.phase needs sweep.fault"),
        ({"sweep": {"fault": ["none", "lost"]}}, "sweep.fault"),
        ({"sweep": {"fault": {"uniform": [0, 1]}}}, "sweep.fault: give a list of names"),
        (
            {"sweep": {"fault": ["none", "lost"], "fault.after_s": ["soon", "late"]}},
            "sweep.fault.after_s: each value must be a number",
        ),
        (
            {
                "sweep": {"fault": ["none", "lost"]},
                "faults": {"lost": {**SILENCE, "inject": [{"kind": "gps_loss", "at_s": 3.0}]}},
            },
            "faults.lost: phase and after_s say when the fault begins; take out at_s",
        ),
        (
            {
                "sweep": {"fault": ["none", "lost"]},
                "faults": {"lost": {**SILENCE, "inject": [{"kind": "no_such_fault"}]}},
            },
            "faults.lost: ",
        ),
    ],
)
def test_a_fault_that_is_none(tmp_path, told, words):
    faults = {"lost": SILENCE} if "fault.after_s" in told["sweep"] else {}
    assert words in refusal(tmp_path, samples=2, **{"faults": faults, **told})


def test_a_key_of_the_mock_vehicle_without_its_prefix(tmp_path):
    """It read: `wind` is not a known key; did you mean `include`?"""
    said = refusal(tmp_path, sweep={WIND.removeprefix("mock."): [2, 4]})
    assert f"there is no section `wind`; did you mean {WIND}?" in said


def test_a_key_that_two_factors_change(tmp_path):
    gusts = {"values": [0, 1], "keys": [WIND]}
    said = refusal(tmp_path, sweep={WIND: [2, 4], "gusts": gusts}, samples=2)
    assert f"sweep: `{WIND}` and `gusts` both change `{WIND}`; remove it from one of them" in said


def test_a_fault_cannot_be_called_none_nor_be_in_a_batch(tmp_path):
    said = refusal(tmp_path, faults={"none": SILENCE})
    assert "faults: none means a flight without a fault; choose another name" in said
    steps = {"flight.maneuvers": ["corners"]}
    for told in ({"faults": {"lost": SILENCE}}, {"sweep": {"fault": ["none", "x"]}}):
        assert "`faults` need `kind: flights`" in refusal(tmp_path, kind="batch", set=steps, **told)


@pytest.mark.parametrize(
    ("told", "words"),
    [
        (
            {
                "sweep": {
                    "x": {"uniform": [1, 2], "times_base": True, "keys": ["vehicle.pitch_damping"]}
                }
            },
            "sweep.x: times_base needs a number in the base configuration, and "
            "vehicle.pitch_damping is None",
        ),
        (
            {"sweep": {"link.signing_key_file": ["a", "b"]}},
            "`link.signing_key_file`: campaigns fly without signing",
        ),
        ({"set": {"mock.airframe.no.such": 1}}, "unknown key mock.airframe.no"),
        ({"set": {"limits.max_tilt_deg": 120}}, "max_tilt_deg"),
        ({"sweep": {"flight.trajectory": [5, 6]}}, "flight.trajectory: each value must be a path"),
        (
            {"sweep": {"flight.trajectory": {"uniform": [0, 1]}}},
            "flight.trajectory: each value must be a path",
        ),
    ],
)
def test_a_key_that_cannot_take_its_value(tmp_path, told, words):
    said = refusal(tmp_path, **told)
    assert words in said
    assert str(tmp_path) in said


def test_a_case_is_described_with_its_values(tmp_path):
    told = {"sweep": {"vehicle.damping": [None, 0.7], "planner.gain_per_s": [1.23456789]}}
    first, second = load(
        tmp_path, set={"vehicle.lag_ms": 50, "vehicle.dead_time_ms": 9}, **told
    ).cases()
    assert first.description() == "case 0 (vehicle.damping = null, planner.gain_per_s = 1.23457)"
    assert second.description() == "case 1 (vehicle.damping = 0.7, planner.gain_per_s = 1.23457)"
    assert (
        load(tmp_path, sweep={}).case(next(load(tmp_path, sweep={}).planned_cases())).description()
        == "case 0"
    )


def write_trajectory(path):
    path.parent.mkdir(exist_ok=True)
    path.write_text("\n".join(["t,x,y,z", *(f"{k},{k},0,0" for k in range(9))]))


def test_a_trajectory_that_is_named_twice_is_copied_once(tmp_path):
    write_trajectory(tmp_path / "t.csv")
    path = {"flight.trajectory": "t.csv"}
    told = load(tmp_path, set=path)
    assert list(told.files) == ["trajectories/t/t.csv"]
    write_trajectory(tmp_path / "other" / "t.csv")
    told = load(tmp_path, sweep={"flight.trajectory": ["t.csv", "other/t.csv"]})
    assert sorted(told.files) == ["trajectories/t-2/t.csv", "trajectories/t/t.csv"]
    config = {"flight": {"maneuvers": ["trajectory"], "trajectory": "t.csv"}}
    told = load(tmp_path, config=config, sweep={"flight.trajectory": ["t.csv", "other/t.csv"]})
    assert len(told.files) == 2


def test_trajectories_of_the_same_name_are_different_factors(tmp_path):
    write_trajectory(tmp_path / "t.csv")
    write_trajectory(tmp_path / "other" / "t.csv")
    told = load(tmp_path, sweep={"flight.trajectory": ["t.csv", "other/t.csv"]})
    assert [case.factors["flight.trajectory"] for case in told.cases()] == ["t", "t-2"]


@pytest.mark.parametrize(
    ("config", "words"),
    [
        ({"link": {"backend": "mavsdk"}}, "link.backend must be direct in a campaign"),
        ({"link": {"signing_key_file": "key"}}, "campaigns fly without signing"),
        ({"flight": {"maneuvers": ["trajectory"], "trajectory": "missing.csv"}}, "missing.csv"),
    ],
)
def test_a_link_or_a_path_that_no_flight_in_memory_has(tmp_path, config, words):
    (tmp_path / "key").write_text("secret\n")
    assert words in refusal(tmp_path, config=config, sweep={WIND: [0.0, 3.0]})
