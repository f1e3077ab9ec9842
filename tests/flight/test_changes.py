"""Changes of limits, gains and weights in flight: checked, slewed, recorded, undone."""

import asyncio
import json
from contextlib import contextmanager
from itertools import pairwise
from math import degrees

import pytest

from companion.attitude.model_following import ModelFollowingPlanner
from companion.config import Config
from companion.config.files import changed, load
from companion.config.in_flight import changeable_keys, differences
from companion.control.retuning import SLEW_TIME, interpolated_config
from companion.flight.changes import ChangeRefusedError, Changes
from companion.recording.flight_record import read_flight
from companion.replay.replay import Replay
from tests.flight.fly import mock_vehicle, run, session_for

_HOVER = {"duration_s": 4.0}
BAD = {
    "number as text": {"limits": {"max_tilt_deg": "20"}},
    "words": {"limits": {"max_tilt_deg": "steep"}},
    "boolean": {"planner": {"gain_per_s": True}},
    "null where there is none": {"limits": {"max_tilt_deg": None}},
    "not a number": {"planner": {"gain_per_s": float("nan")}},
    "infinite": {"planner": {"gain_per_s": float("inf")}},
    "list": {"limits": {"max_tilt_deg": [20.0]}},
    "keys": {"limits": {"max_tilt_deg": {"x": 1.0}}},
    "below its range": {"limits": {"max_tilt_deg": 0.5}},
    "beyond its range": {"guidance": {"position_weight_per_s4": 1e5}},
    "negative": {"guidance": {"height_gain_per_s": -1.0}},
    "unknown key": {"limits": {"max_tild_deg": 20.0}},
    "unknown section": {"limit": {"max_tilt_deg": 20.0}},
    "fence": {"limits": {"fence_radius_m": 500.0}},
    "monitor": {"safety": {"max_speed_m_s": 30.0}},
    "deadman": {"deadman": {"telemetry_stale_ms": 400.0}},
    "planner": {"planner": {"name": "euler"}},
    "link": {"link": {"endpoint": "udpin://0.0.0.0:1"}},
    "section without keys": {"mock": {"autopilot": "px4"}},
    "more than at the start": {"limits": {"max_tilt_deg": 36.0}},
    "good beside bad": {"planner": {"gain_per_s": 4.0}, "limits": {"max_thrust": 0.8}},
    "more than threefold": {"planner": {"gain_per_s": 15.5}},
    "less than a third": {"guidance": {"position_weight_per_s4": 5.0}},
    "bandwidth from null": {"guidance": {"disturbance_bandwidth_rad_s": 4.0}},
    "no height gain": {"guidance": {"height_gain_per_s": 0.0}},
    "no climb gain": {"guidance": {"climb_gain_per_s": 0.0}},
    "no yaw gain": {"planner": {"yaw_gain_per_s": 0.0}},
    "hardly any tilt": {"limits": {"max_tilt_deg": 4.0}},
    "hardly any tilt rate": {"limits": {"max_tilt_rate_deg_s": 15.0}},
    "the same again": {"limits": {"max_tilt_deg": 35.0}},
    "nothing": {},
}


@pytest.mark.parametrize("values", BAD.values(), ids=BAD)
def test_a_bad_change_changes_nothing_and_is_explained(values):
    changes = Changes(Config())
    with pytest.raises(ChangeRefusedError) as refused:
        changes.change(values, "a test")
    assert changes.wanted_config == Config()
    assert not changes.all_changes
    assert not changes.can_undo
    told = str(refused.value)
    assert told.startswith("a test: ")
    assert "\n" not in told


def test_limits_that_contradict_each_other_are_refused():
    start = changed(
        Config(), {"flight": {"maneuvers": ["steps"]}, "steps": {"coefficient": 0.5}}, "test"
    )
    with pytest.raises(ChangeRefusedError, match=r"steps\.coefficient must not exceed"):
        Changes(start).change({"limits": {"max_tilt_deg": 20.0}}, "a test")


@pytest.mark.parametrize(
    ("section", "key", "value"), [("guidance", "kind", "nmpc"), ("limits", "max_climb_m_s", 2.0)]
)
def test_with_predictive_control_nothing_changes(section, key, value):
    start = changed(Config(), {"guidance": {"kind": "nmpc"}}, "test")
    with pytest.raises(ChangeRefusedError):
        Changes(start).change({section: {key: value}}, "a test")
    with pytest.raises(ChangeRefusedError, match="keeps the values with which the flight began"):
        Changes(start).change({"limits": {"max_climb_m_s": 1.0}}, "a test")


@pytest.mark.parametrize(
    "key", ["position_weight_per_s4", "velocity_weight_per_s2", "disturbance_bandwidth_rad_s"]
)
def test_values_that_identify_does_not_use_are_refused(key):
    start = changed(
        Config(),
        {"flight": {"maneuvers": ["identify"]}, "guidance": {"disturbance_bandwidth_rad_s": 4.0}},
        "test",
    )
    with pytest.raises(ChangeRefusedError, match=f"{key} has no effect while .*identify"):
        Changes(start).change({"guidance": {key: 5.0}}, "a test")


@pytest.mark.parametrize("fault", [ValueError("fault"), OverflowError("fault")])
def test_a_change_without_gains_is_refused(fault, monkeypatch):
    def loop_settings(_):
        raise fault

    monkeypatch.setattr("companion.flight.changes.loop_settings", loop_settings)
    changes = Changes(Config())
    with pytest.raises(ChangeRefusedError, match="a test: fault; nothing has changed"):
        changes.change({"planner": {"gain_per_s": 4.0}}, "a test")
    assert not changes.all_changes


def test_the_way_of_a_change_is_even_and_null_counts_as_what_it_comes_to():
    before = Config()
    after = changed(before, {"guidance": {"position_weight_per_s4": 1000.0}}, "test")
    weights = [
        interpolated_config(before, after, 0.1 * k).guidance.position_weight_per_s4
        for k in range(1, 11)
    ]
    ratios = [b / a for a, b in pairwise(weights)]
    assert max(ratios) == pytest.approx(min(ratios), rel=1e-6)
    assert interpolated_config(before, after, 1.0) is after
    assert {each.name for each in differences(before, after)} == {"guidance.position_weight_per_s4"}


async def test_a_second_change_counts_together_with_one_that_still_takes_effect():
    """Two changes by 2.5 each are one by 6.25, until the first is in effect."""

    class Loops:
        @contextmanager
        def before_each_step(self, _):
            yield

        def apply(self, _):
            pass

    changes = Changes(Config())
    with changes.applying(Loops(), lambda _: None, None):
        changes.change({"planner": {"gain_per_s": 2.0}}, "the page")
        with pytest.raises(ChangeRefusedError, match=r"from 5 to 0\.8 is more than a factor"):
            changes.change({"planner": {"gain_per_s": 0.8}}, "the file")
        assert changes.wanted_config.planner.gain_per_s == 2.0
        changes.step(asyncio.get_running_loop().time() + SLEW_TIME)
        changes.change({"planner": {"gain_per_s": 0.8}}, "the file")


def test_safety_is_not_changeable():
    sections = {section for section, _ in changeable_keys()}
    assert sections == {"planner", "limits", "guidance"}
    fixed = {"fence_radius_m", "fence_ceiling_m", "fence_floor_m", "min_battery_percent"}
    assert not fixed & {key for _, key in changeable_keys()}


def _constants(planner):
    return planner._constants if isinstance(planner, ModelFollowingPlanner) else planner.constants


@pytest.mark.parametrize(
    ("autopilot", "vehicle"),
    [("px4", {"lag_ms": 30.0, "dead_time_ms": 20.0}), ("ardupilot", {})],
    ids=["px4, model-following", "ardupilot, first-order"],
)
def test_changes_in_flight_are_slewed_recorded_and_undone(autopilot, vehicle, tmp_path):
    seen, texts = [], []
    values = {
        "limits": {"max_tilt_deg": 20.0, "max_tilt_rate_deg_s": 60.0},
        "planner": {"gain_per_s": 4.0},
        "guidance": {"position_weight_per_s4": 150.0},
    }

    async def fly(session):
        flight = asyncio.ensure_future(session.fly())
        assembled = None
        while assembled is None or not assembled.context.loop.offboard_active:
            await asyncio.sleep(0.05)
            assembled = session._assembled
        loop, guidance_loop = assembled.context.loop, assembled.context.guidance_loop
        await asyncio.sleep(0.5)
        texts.append(session.changes.change(values, "a test"))
        for _ in range(60):
            await asyncio.sleep(0.02)
            planner = loop.planner._planner
            seen.append(
                (
                    degrees(guidance_loop.hold.max_tilt),
                    _constants(planner).gain,
                    guidance_loop.command_maker.guidance._settings.gains.position,
                    degrees(loop.planner._limits.tilt_rate),
                )
            )
        with pytest.raises(ChangeRefusedError):
            session.changes.change({"limits": {"fence_radius_m": 500.0}}, "a test")
        texts.append(session.changes.undo("a test"))
        await asyncio.sleep(1.5 * SLEW_TIME)
        seen.append((degrees(guidance_loop.hold.max_tilt), _constants(planner).gain, 0.0, 0.0))
        return await flight

    with mock_vehicle(autopilot=autopilot) as mock:
        summary = run(mock, fly(session_for(mock, tmp_path, hover=_HOVER, vehicle=vehicle)))
    assert summary.result == "ok"
    assert seen[49] == pytest.approx((20.0, 4.0, seen[59][2], 60.0))  # within a second
    assert seen[-1][:2] == pytest.approx((35.0, 5.0))
    for which in range(4):  # no step: each a twelfth of the way at most
        way = [row[which] for row in seen[:60]]
        steps = [abs(b - a) for a, b in pairwise(way)]
        assert max(steps) < 0.12 * abs(way[-1] - way[0])
    told = json.loads((tmp_path / "summary.json").read_text())
    assert [change["by"] for change in told["changes"]] == ["a test"] * 2
    assert told["changes"][0]["keys"]["limits.max_tilt_deg"] == [35.0, 20.0]
    assert told["changes"][1]["keys"]["guidance.position_weight_per_s4"] == [150.0, None]
    assert set(texts) <= {event["text"] for event in told["events"]}
    assert told["tracking"]["position_max_m"] < 0.1
    replay = Replay(read_flight(tmp_path), load(tmp_path / "config.yaml"))
    assert not replay.follows_record
    assert [each for each in replay.run() if not each.is_same] == []
