"""The page about a campaign, from results whose causes are known."""

import argparse
import json
import re
from math import isnan
from pathlib import Path

import numpy as np
import pyarrow
import pyarrow.csv
import pyarrow.parquet
import pytest

from companion.campaign import folder, loading, store
from companion.campaign.report import page
from companion.campaign.report.page import run
from companion.campaign.report.results import Results
from companion.campaign.report.statistics import levels, pareto_front, share_of
from companion.files.yaml_file import ConfigError
from companion.program_command import program_command

CAMPAIGN = {
    "name": "planners",
    "config": {"mock": {"autopilot": "px4"}},
    "samples": 60,
    "set": {"limits.max_tilt_deg": 21.0, "mock.wind.gust_m_s": 0.3},
    "sweep": {
        "planner.name": ["first-order", "so3", "euler"],
        "mock.wind.speed_m_s": {"uniform": [0, 10]},
        "mock.airframe.mass_kg": {"uniform": [0.8, 1.2]},
    },
}


def row_of(case, noise):
    """An error by planner and wind; the mass has no effect. Strong wind lets `euler` crash."""
    planner, wind = case.factors["planner.name"], case.factors["mock.wind.speed_m_s"]
    error = {"first-order": 0.1, "so3": 0.2, "euler": 0.4}[planner] + 0.02 * wind + noise
    crashed = planner == "euler" and wind > 9.0
    return {
        "case": case.index,
        "seed": case.seed,
        **case.factors,
        "ok": not crashed,
        "result": "</script>" if crashed else "ok",
        "failed_checks": "",
        "crashed": crashed,
        "position_rms_m": None if crashed else error,
        "rate_rms_rad_s": 0.5 - 0.5 * error,
        "thrust_rms": 0.02,
        "setpoints": 1000,
        "digest": "",
    }


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    """A campaign of which the last unit is missing."""
    place = tmp_path_factory.mktemp("campaign")
    (place / "file.yaml").write_text(json.dumps(CAMPAIGN))
    campaign = loading.load(place / "file.yaml")
    out = place / "planners"
    folder.make(out, campaign, folder.describe(campaign, 30, 0.1))
    noise = np.random.default_rng(1).normal(0.0, 0.002, 180)
    rows = [row_of(case, float(noise[case.index])) for case in campaign.cases()]
    for number in range(5):
        unit = rows[30 * number : 30 * number + 30]
        store.write_unit(out, campaign.file, number, unit, {})
    return out, rows[:150]


def test_the_page_says_what_was_flown_how_it_went_and_summary_sentences(flown, capsys):
    place, rows = flown
    assert run(argparse.Namespace(folder=place, out=None)) == 0
    said = " ".join(capsys.readouterr().out.split())
    crashed = [row["case"] for row in rows if row["crashed"]]
    assert len(crashed) > 2
    good = 150 - len(crashed)
    assert f"planners: {good} of 150 flights good: " in said
    assert "30 of 180 flights are missing" in said
    html = (place / "report.html").read_text("utf-8")
    body = re.sub(r"<script.*?</script>", "", html, flags=re.S)
    assert f"{good} of 150 flights good" in body
    assert f"{len(crashed)} flights crashed" in body
    assert "Success is lowest with mock.wind.speed_m_s = " in body
    assert re.search(r"planner.name explains \d\d% ± \d+% of the variance", body)
    assert f"{program_command('campaign', 'rerun', place, str(crashed[0]))}<" in body
    assert "http" not in body
    # What it flew with: what was set, limits that are the default, and nothing that was swept.
    flown_with = re.search(r"Configuration of every case.*?</table>", body, re.S)[0]
    assert "<td>limits.max_tilt_deg</td><td>21.0</td>" in flown_with
    assert "<td>limits.max_tilt_rate_deg_s</td>" in flown_with
    assert "<td>mock.wind.gust_m_s</td><td>0.3</td><td>0.0</td><td>m/s</td>" in flown_with
    assert "planner.name" not in flown_with
    assert "mass_kg" not in flown_with
    assert "its own report shows the error estimated_rms_m" in body
    influence = re.search(r"Share of the variance.*?</table>", body, re.S)[0]
    shares = dict(re.findall(r"<td>(\S+)</td><td>(-?\d+)%", influence))
    assert int(shares["planner.name"]) > int(shares["mock.wind.speed_m_s"]) > 5
    assert int(shares["mock.airframe.mass_kg"]) < 5
    plots = json.loads(re.search(r'type="application/json">(.*?)</script>', html, re.S)[1])
    assert len(plots) == len(re.findall(r'<div id="plot\d+"', body))


@pytest.mark.parametrize(
    ("documented", "words", "first"),
    [
        (
            [True, True],
            "c: 2 of 2 flights with a fault ended as documented: 100 %",
            "1 of 2 flights were good in spite of the fault",
        ),
        (
            [False, True],
            "c: 1 of 2 flights with a fault ended as documented: 50",
            "1 of 2 flights were good in spite of the fault",
        ),
        ([None, True], "c: 1 of 2 flights good: 50", "1 of 1 flights with a fault ended"),
    ],
)
def test_with_a_fault_in_each_flight_the_ending_counts(documented, words, first):
    columns = {"ok": [True, False], "as_documented": documented, "result": ["ok", "GPS lost"]}
    results = Results(Path(), "c", "flights", 2, {}, pyarrow.table(columns))
    assert page.headline(results).startswith(words)
    assert first in " ".join(page.summary_sentences(results, {}))


def test_all_results_stand_in_one_table(flown):
    place, rows = flown
    run(argparse.Namespace(folder=place, out=place / "other.html"))
    assert (place / "other.html").exists()
    table = pyarrow.parquet.read_table(place / "results.parquet")
    assert table.column("position_rms_m").to_pylist() == [row["position_rms_m"] for row in rows]
    read = pyarrow.csv.read_csv(place / "results.csv")
    assert read.column("planner.name").to_pylist() == [row["planner.name"] for row in rows]


def test_a_folder_without_results_is_refused(tmp_path):
    with pytest.raises(ConfigError, match="no campaign was begun here"):
        run(argparse.Namespace(folder=tmp_path, out=None))


def test_a_share_has_its_wilson_interval():
    share = share_of(np.arange(100) < 90)
    assert (share.share, share.low, share.high) == pytest.approx((0.9, 0.8256, 0.9448), abs=1e-4)
    assert str(share) == "90.0 % (82.6 to 94.5 %)"
    assert share_of(np.ones(50, dtype=bool)).low < 0.94
    assert isnan(share_of(np.zeros(0, dtype=bool)).share)


def test_the_levels_of_a_factor_hold_each_case_once():
    for column in (
        np.linspace(0.0, 1.0, 101),
        np.array([1.0, 2.0, 1.0]),
        np.array(["a", None, "b"], dtype=object),
        np.array([1.0, np.nan, 2.0, np.nan]),
        np.array([*np.arange(20.0), np.nan, np.nan]),
        np.array([True, False, True], dtype=object),
        np.array([f"word {number:02}" for number in range(14)], dtype=object),
    ):
        found = levels(column)
        assert len(found) <= 12
        assert np.sum([level.cases for level in found], axis=0).tolist() == [1] * len(column)
    assert [level.name for level in levels(np.array([True, False], dtype=object))] == [
        "false",
        "true",
    ]


def test_the_pareto_front_holds_what_nothing_beats():
    goals = np.array([[1.0, 3.0], [2.0, 2.0], [3.0, 1.0], [3.0, 3.0], [2.0, 2.0]])
    assert pareto_front(goals).tolist() == [True, True, True, False, True]


def test_reasons_are_counted_whatever_numbers_are_in_them():
    columns = {
        "ok": [True, False, False, False],
        "result": ["ok", "tracking error 12.4 m", "tracking error 3 m", "ok"],
        "failed_checks": ["", "", "", "circle: too far from its path"],
    }
    results = Results(Path(), "c", "flights", 4, {}, pyarrow.table(columns))
    assert results.failures() == {
        "tracking error … m": 2,
        "circle: too far from its path": 1,
    }
