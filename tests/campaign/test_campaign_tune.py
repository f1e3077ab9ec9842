"""The search of a campaign's keys, with flights whose error is known; and one that really flies."""

import json
from typing import NamedTuple

import numpy as np
import pytest

from companion.campaign import loading
from companion.campaign.tune import candidates
from companion.campaign.tune.candidates import (
    cases,
    configured_values,
    start_candidates,
    tune_section,
    unseen_campaign,
)
from companion.campaign.tune.certainty import compare
from companion.campaign.tune.first_flight import learned_config
from companion.campaign.tune.scores import Score, score_of
from companion.campaign.tune.search import Search
from companion.campaign.tune.writing import CheckedResult, result_text, summary_lines
from companion.cli.main import main
from companion.config.files import load, shipped
from companion.files.yaml_file import ConfigError
from tests.campaign import unlike

FILE = {
    "name": "tuned",
    "config": str(shipped("mock-px4.yaml")),
    "samples": 4,
    "set": {"flight.maneuvers": ["circle"], "circle.laps": 0.5, "mock.prearm_delay_s": 0.2},
    "tune": {
        "trials": 14,
        "envelope_m": 1.0,
        "check_samples": 3,
        "search": {
            "planner.gain_per_s": {"uniform": [2.0, 8.0]},
            "guidance.drag_per_s": {"uniform": [0.2, 2.0]},
        },
    },
}
BEST = {"planner.gain_per_s": 6.0, "guidance.drag_per_s": 0.6}


def campaign(folder, **changes):
    path = folder / "tuned.yaml"
    path.write_text(json.dumps(FILE | changes))
    return loading.load(path)


def row_of(case):
    """A flight whose error grows with the distance from `BEST`; above a gain of 7 it crashes."""
    gain, drag = case.config.planner.gain_per_s, case.config.guidance.drag_per_s
    noise = np.random.default_rng(case.seed).normal(1.0, 0.02)
    error = noise * float(0.05 + 0.05 * abs(gain - 6.0) + 0.2 * abs(drag - 0.6))
    return {
        "result": "ok",
        "crashed": gain > 7.0,
        "level_rms_m": error,
        "estimated_level_rms_m": 0.5 * error,
        "estimate_level_rms_m": 0.1,
        "position_max_m": 2.0 * error,
    }


class Fleet:
    """Flies cases, and is interrupted before the flight of this number."""

    def __init__(self, interrupted=None):
        self.flown, self.interrupted = 0, interrupted

    def __call__(self, some):
        self.flown += len(some)
        if self.interrupted is not None and self.flown > self.interrupted:
            raise KeyboardInterrupt
        return [row_of(case) for case in some]


class Proposal(NamedTuple):
    """What `companion tune` would propose; it takes seconds."""

    changes: dict


def searched(place, folder, fleet, trials=14):
    folder.mkdir(exist_ok=True)
    made = campaign(place)
    with pytest.MonkeyPatch.context() as patch:
        proposal = Proposal({"planner": {"gain_per_s": 5.5}, "limits": {"max_tilt_deg": 30.0}})
        patch.setattr(candidates, "propose", lambda _: proposal)
        patch.setattr("companion.campaign.tune.search.learned_config", lambda _: None)
        search = Search(made, tune_section(made), folder, fleet)
    *_, found = search.run(trials)
    return found, search


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A search that was not interrupted, and the number of its flights."""
    place, fleet = tmp_path_factory.mktemp("whole"), Fleet()
    found, search = searched(place, place / "search", fleet)
    return found, [trial.user_attrs["values"] for trial in search._ended_trials()], fleet.flown


def test_it_starts_with_the_configuration_and_finds_a_better_one(whole):
    found, tried, flights = whole
    assert tried[0] == {"planner.gain_per_s": 5.0, "guidance.drag_per_s": 1.0}
    assert tried[1] == {"planner.gain_per_s": 5.5, "guidance.drag_per_s": 1.0}
    assert found.tried_count == 14
    assert found.best.score.rms < 0.7 * 0.18  # 0.18 m with the configuration as it is
    assert found.best.values["planner.gain_per_s"] <= 7.0
    assert found.near_best[0] == found.best
    assert found.stopped_early_count > 1  # crashes, and errors far above the best one
    assert flights == 4 * (14 - found.stopped_early_count) + 2 * found.stopped_early_count


def test_an_interrupted_search_goes_on_with_the_same_candidates(whole, tmp_path):
    found, tried, flights = whole
    with pytest.raises(KeyboardInterrupt):
        searched(tmp_path, tmp_path / "search", Fleet(interrupted=13))
    fleet = Fleet()
    again, search = searched(tmp_path, tmp_path / "search", fleet)
    assert [trial.user_attrs["values"] for trial in search._ended_trials()] == tried
    assert again.best.values == found.best.values
    assert flights - 13 <= fleet.flown < flights - 7


def test_the_result_tells_how_sure_it_is_and_can_be_included(whole, tmp_path):
    made = campaign(tmp_path)
    other, found = unseen_campaign(made, 3), whole[0]
    assert {case.seed for case in other.cases()}.isdisjoint(case.seed for case in made.cases())
    before = score_of([row_of(case) for case in other.cases()], 1.0)
    after = score_of([row_of(case) for case in cases(other, found.best.values)], 1.0)
    comparison = compare(before, after, 3)
    result = CheckedResult(made, found, found.best, before, after, comparison)
    assert comparison.ratio.low <= comparison.ratio.value <= comparison.ratio.high < 0.8
    assert comparison.better_samples == comparison.samples == 3
    said = " ".join(summary_lines(result))
    assert f"{comparison.ratio.value:.2f} times the error before" in said
    assert "14 candidates over 4 flights each" in said
    path = tmp_path / "result.yaml"
    path.write_text(result_text(result, configured_values(made.base, FILE["tune"]["search"])))
    assert "was 5; the best " in path.read_text()
    assert load(path).planner.gain_per_s == found.best.values["planner.gain_per_s"]


def test_a_flight_that_ended_early_is_no_error_but_is_told(tmp_path):
    flown, ended = [row_of(case) for case in campaign(tmp_path).cases()], None
    ended = flown[0] | {"result": "the fence was left"}
    score = score_of([*flown[:2], ended, flown[3]], 1.0)
    assert score.is_inside == (True, True, False, True)
    assert Score._make(map(tuple, json.loads(json.dumps(score)))) == score
    comparison = compare(score, score_of(flown, 1.0), 4)
    assert comparison.samples == 3
    assert comparison.ratio.value == pytest.approx(1.0)
    # The estimated errors are those of the same three samples.
    assert comparison.estimated_errors == pytest.approx([0.5 * comparison.before.value] * 2)
    assert comparison.estimator_errors == pytest.approx([0.1] * 2)


@pytest.mark.slow
def test_the_search_also_starts_with_what_companion_tune_proposes(tmp_path):
    made = campaign(tmp_path)
    found = list(start_candidates(made, tune_section(made)))
    assert [start.name for start in found] == ["the configuration", "companion tune"]
    assert found[1].values["planner.gain_per_s"] != 5.0


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_a_first_flight_teaches_a_vehicle_that_is_40_percent_off(tmp_path):
    path = tmp_path / "unlike.yaml"
    path.write_text(json.dumps(unlike.campaign("px4", 1.4)))
    made = loading.load(path)
    known = learned_config(made)
    assert known.vehicle.lag_ms + known.vehicle.dead_time_ms == pytest.approx(1.4 * 87.0, rel=0.1)
    assert known.guidance.drag_per_s == pytest.approx(1.4, rel=0.15)
    found = list(start_candidates(made, tune_section(made), known))
    assert [start.name for start in found] == [
        "the configuration",
        "a first flight",
        "companion tune",
    ]
    assert found[1].values["vehicle.lag_ms"] == known.vehicle.lag_ms


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"sweep": {"planner.gain_per_s": [4, 5]}}, "is in sweep and in tune.search; remove it"),
        ({"tune": {"search": {"planner.gain": {"uniform": [1, 2]}}}}, "gain_per_s"),
        (
            {"tune": {"search": {"mock.seed": {"uniform": [1, 2]}}}},
            "keys of the mock vehicle cannot be searched",
        ),
        ({"tune": {"search": {"planner.gain_per_s": [1, 2]}}}, "give uniform, loguniform or"),
        ({"set": {"flight.maneuvers": ["corners", "steps"]}}, "set flight.maneuvers to"),
    ],
)
def test_a_search_that_cannot_be_is_refused(tmp_path, changes, message):
    with pytest.raises(ConfigError, match=message):
        tune_section(campaign(tmp_path, **changes))


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_it_searches_with_real_flights_and_goes_on(tmp_path, capsys):
    campaign(tmp_path, tune=FILE["tune"] | {"trials": 2, "check_samples": 2}, samples=2)
    command = ["campaign", "tune", str(tmp_path / "tuned.yaml"), "--out", str(tmp_path / "search")]
    assert main([*command, "--workers", "2"]) == 0
    assert "2 candidates over 2 flights each" in capsys.readouterr().out
    assert main([*command, "--workers", "1", "--trials", "3"]) == 0
    assert "3 candidates over 2 flights each" in capsys.readouterr().out
    assert load(tmp_path / "search" / "tuned.yaml").planner.gain_per_s > 0.0
