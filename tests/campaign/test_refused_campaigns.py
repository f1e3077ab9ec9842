"""What a campaign's file must not say: each is one sentence that names the place."""

import pytest

from tests.campaign.test_campaign_file import refusal

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
        ({"uniform": [0, 8], "within": [1, 2]}, "within needs normal"),
        ({"values": ["a", "b"], "times_base": True}, "times_base needs numbers"),
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
            "faults.lost: phase and after_s say when it begins; take out at_s",
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
