"""The parts of a campaign's page, from small tables of results."""

from math import isnan, nan
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pyarrow
import pytest

from companion.campaign import outcomes
from companion.campaign.case import Fault
from companion.campaign.flight import _ending, _FaultInjector
from companion.campaign.report import page, plots, tables
from companion.campaign.report.results import Results
from companion.campaign.report.sensitivity import Influence, influences
from companion.campaign.report.statistics import choice_groups
from companion.program_command import program_command
from tests.campaign.test_campaign_file import load

SAMPLED = {"sampled": True}


def results(columns, factors=(), kind="flights", planned=None):
    count = len(columns["ok"])
    columns = {
        "case": list(range(count)),
        "result": ["ok"] * count,
        "failed_checks": [""] * count,
    } | columns
    told = {name: {"sampled": False} for name in factors}
    return Results(Path("a [b]"), "c", kind, planned or count, told, pyarrow.table(columns))


def test_a_batch_has_no_command_that_flies_a_case_again():
    told = {"ok": [True, False], "model_deviation_max": [0.1, 0.2]}
    batch = tables.worst_cases(results(told, kind="batch"))
    assert [row[1] for row in batch.rows] == [tables.EMPTY] * 2
    flights = tables.worst_cases(results(told))
    assert [row[:2] for row in flights.rows] == [
        ("1", program_command("campaign", "rerun", "a [b]", "1")),
        ("0", program_command("campaign", "rerun", "a [b]", "0")),
    ]


def test_success_by_fault_also_tells_how_flights_ended():
    told = {
        "ok": [True, False, True],
        "fault": ["gone", "gone", "none"],
        "as_documented": [True, False, None],
        "position_rms_m": [0.1, 0.3, None],
        "rate_rms_rad_s": [None, None, None],
    }
    table = tables.success_by_factor(
        results({**told, "rate_rms_rad_s": [0.5, 0.7, 0.9]}, ["fault"]), ["fault"]
    )
    assert table.header[4] == "ended as documented (95 % interval)"
    gone, none = table.rows
    assert gone[:4] == ("fault", "gone", "2", "50.0 % (9.5 to 90.5 %)")
    assert gone[4:] == ("50.0 % (9.5 to 90.5 %)", "0.2", "0.6")
    assert none[4:] == (tables.EMPTY, tables.EMPTY, "0.9")


def test_two_factors_with_few_values_are_crossed():
    told = {
        "ok": [True, True, False, True],
        "a": ["x", "x", "y", "y"],
        "b": [True, False, True, False],
        "wind": [1.0, 1.0, 1.0, 1.0],
        "position_rms_m": [0.1, 0.2, 0.3, None],
    }
    table = tables.two_factors(results(told, ["wind", "a", "b"]))
    assert table.title == "Median true position error, RMS, m and share of good flights: a × b"
    assert table.header == ("a", "false", "true")
    assert table.rows == [("x", "0.2 (100%)", "0.1 (100%)"), ("y", "– (100%)", "0.3 (0%)")]
    assert tables.two_factors(results(told, ["wind", "a"])) is None


def test_missing_and_boolean_values_are_written_as_such():
    told = {"ok": [True], "crashed": [False], "position_rms_m": [float("nan")], "note": [""]}
    (row,) = tables.all_cases(results(told)).rows
    assert row == ("0", "ok", tables.EMPTY, "yes", "no", tables.EMPTY, tables.EMPTY)


def test_of_many_cases_some_are_listed_evenly():
    table = tables.all_cases(results({"ok": [True] * 1000}))
    assert table.title.startswith("Cases, 200 of 1000 (")
    listed = [int(row[0]) for row in table.rows]
    assert (listed[0], listed[-1]) == (0, 999)
    assert set(np.diff(listed)) == {5, 6} or set(np.diff(listed)) == {5}


def test_without_factors_or_crashes_the_page_says_what_was_flown():
    told = {"ok": [False, True], "result": ["fence left", "ok"], "crashed": [False, False]}
    lines = list(page.summary_sentences(results(told), {}))
    assert lines == [
        "Swept: nothing but noise and gusts.",
        "Most frequent reason why a case was not good, 1 times: fence left.",
    ]


def test_the_reason_is_the_result_then_the_checks_then_the_crash():
    told = {
        "ok": [False, False, False],
        "result": ["fence left", "ok", "ok"],
        "failed_checks": ["touchdown", "touchdown", ""],
    }
    found = results(told)
    assert [found.reason(row) for row in range(3)] == ["fence left", "touchdown", "crashed"]


def test_some_flights_with_a_fault_are_counted_beside_the_others():
    told = {"ok": [True, True, False], "as_documented": [True, False, None], "a": [1.0, 2.0, 3.0]}
    lines = list(page.summary_sentences(results(told, ["a"]), {}))
    assert "1 of 2 flights with a fault ended as documented." in lines
    assert any(line.startswith("Sensitivity needs at least") for line in lines)
    assert lines[-1].startswith("Success is lowest with a = 3")


def test_equal_success_everywhere_points_to_no_factor():
    lines = list(page.summary_sentences(results({"ok": [True, True], "a": ["x", "y"]}, ["a"]), {}))
    assert not any("Success is lowest" in line for line in lines)


def test_few_samples_of_a_distribution_are_told():
    told = {"ok": [True] * 20, "position_rms_m": list(np.arange(20.0)), "a": list(np.arange(20.0))}
    found = results(told, ["a"])
    found.factors["a"]["sampled"] = True
    influence = {"position_rms_m": [Influence("a", 0.5, 0.1)]}
    lines = list(page.summary_sentences(found, influence))
    assert "a explains 50% ± 10% of the variance of the true position error by itself." in lines
    warning = "Only 20 different samples"
    assert any(line.startswith(warning) for line in lines)
    found.factors["a"]["sampled"] = False  # a grid of 20 values
    assert not any(line.startswith(warning) for line in page.summary_sentences(found, influence))


def test_an_outcome_that_is_always_the_same_has_no_influence():
    told = {"ok": [True] * 100, "a": list(np.arange(100.0)), "position_rms_m": [0.1] * 100}
    assert influences(results(told, ["a"]), "position_rms_m") == []
    assert list(plots.sensitivity({})) == []
    assert list(plots.distributions(results({"ok": [True] * 9, "position_rms_m": [0.1] * 9}))) == []


def test_the_pareto_plot_needs_two_points_and_marks_the_front():
    told = {
        "ok": [True] * 4,
        "planner.name": ["a", "a", "b", "b"],
        "position_rms_m": [0.1, 0.1, 0.2, 0.2],
        "rate_rms_rad_s": [0.5, 0.5, 0.9, 0.9],
    }
    (plot,) = plots.pareto(results(told, ["planner.name"]))
    front, others = plot.traces
    assert (front["y"], others["y"]) == ([0.1], [0.2])
    assert "error and rate use at once" in plot.note
    assert front["marker"]["color"] != others["marker"]["color"]
    lone = told | {"position_rms_m": [0.1, 0.1, None, None]}
    assert list(plots.pareto(results(lone, ["planner.name"]))) == []


def test_very_many_choices_are_thinned_out():
    told = {"ok": [True] * 1000, "limits.max_tilt_deg": list(np.arange(1000.0))}
    found = choice_groups(results(told, ["limits.max_tilt_deg"]))
    assert [choice.name for choice in found[:2]] == ["case 0", "case 3"]
    assert sum(choice.cases.sum() for choice in found) == len(found) == 334
    twice = {"ok": [True] * 4, "limits.max_tilt_deg": [20.0, 20.0, 30.0, None]}
    found = choice_groups(results(twice, ["limits.max_tilt_deg"]))
    assert [(choice.name, choice.cases.tolist()) for choice in found] == [
        ("limits.max_tilt_deg = null", [False, False, False, True]),
        ("limits.max_tilt_deg = 20", [True, True, False, False]),
        ("limits.max_tilt_deg = 30", [False, False, True, False]),
    ]


class Vehicle:
    time = 7.0

    def __init__(self):
        self.injected = []

    def inject(self, fault):
        self.injected.append(fault)


@pytest.mark.parametrize("phases", [("connect", "stream", "arm"), ("connect", "arm", "takeoff")])
def test_a_fault_of_the_stream_begins_in_the_first_of_its_phases_once(phases):
    vehicle = Vehicle()
    fault = Fault("x", ({"kind": "gps_loss"},), "stream", 0.5, ("held",))
    injector = _FaultInjector(vehicle, fault)
    begun = []
    for phase in phases:
        injector.phase(phase, "")
        begun.append(injector.has_begun)
    assert begun[0] is False
    assert vehicle.injected == [{"kind": "gps_loss", "at_s": 7.5}]


@pytest.mark.parametrize(
    ("mode", "armed", "touchdown", "result", "ending"),
    [
        ("POSCTL", True, None, "the pilot took over: mode Position", "pilot"),
        ("POSCTL", False, 0.4, "the pilot took over: mode Position", "ground"),
        ("AUTO.LOITER", True, None, "the pilot took over: mode Hold", "held"),
        ("AUTO.LOITER", True, None, "ok", "held"),
        ("AUTO.LOITER", False, 0.4, "ok", "ok"),
        ("AUTO.LOITER", False, None, "not armable", "ground"),
        ("Land", False, 0.4, "battery low", "landed"),
    ],
)
def test_how_a_flight_ended(mode, armed, touchdown, result, ending):
    state = {"mode": mode, "armed": armed, "touchdown_speed": touchdown}
    assert _ending(state, result) == ending


def test_missing_cases_are_told_with_the_command_that_goes_on():
    told = {"ok": [True]}
    assert page.missing_cases_note(results(told)) == []
    assert page.missing_cases_note(results(told, planned=3)) == [
        f"2 of 3 flights are missing. `{program_command('campaign', 'a [b]')}` goes on with them."
    ]


def test_a_campaign_of_noise_alone_has_a_page_without_factors(tmp_path):
    told = {"ok": [True, True], "position_rms_m": [0.1, 0.2], "rate_rms_rad_s": [0.5, 0.6]}
    text = page.page_text(results(told), load(tmp_path, samples=2))
    assert "Swept: nothing but noise and gusts." in text
    assert "Success by factor" not in text
    assert "Share of the variance" not in text


def test_steps_without_a_time_constant_have_none():
    class Summary:
        def __init__(self, measured=None, marks=()):
            self._measured, self.trace = measured, SimpleNamespace(maneuvers=marks)

        def response(self):
            return self._measured

    assert outcomes.response(Summary()) == {}
    axis = {"time_constant_north_s": 0.3, "time_constant_east_s": nan}
    both = {"cross_axis_max": 0.01, "model_deviation_max": 0.02}
    measured = SimpleNamespace(**axis, **both)
    assert outcomes.response(Summary(measured)) == both | {"time_constant_s": 0.3}
    measured.time_constant_north_s = nan
    assert isnan(outcomes.response(Summary(measured))["time_constant_s"])
    marks = (SimpleNamespace(vehicle_time=5.0, name="hover"),)
    assert outcomes.control_effort([], Summary(), None) == {}
    assert outcomes.control_effort([SimpleNamespace(time=4.0)], Summary(marks=marks), None) == {}
