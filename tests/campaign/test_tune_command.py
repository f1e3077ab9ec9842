"""The command `companion campaign tune`, with flights that take no time; and the first flights."""

import errno
import os
from dataclasses import replace
from types import SimpleNamespace

import pytest
from sqlalchemy import event
from sqlalchemy.pool import Pool

from companion.campaign import unit
from companion.campaign.cluster import ClusterError
from companion.campaign.swept import SweptValues
from companion.campaign.tune import candidates, command, first_flight
from companion.campaign.tune.candidates import (
    StartCandidate,
    candidates_near,
    clamped_to_search,
    start_candidates,
    suggested_values,
    tune_section,
)
from companion.campaign.tune.certainty import compare
from companion.campaign.tune.scores import Candidate, SearchResults, score_of
from companion.campaign.tune.search import Search
from companion.campaign.tune.writing import CheckedResult, result_text, summary_lines
from companion.campaign.versions import VersionError
from companion.cli.main import main
from companion.config.files import changed, load
from companion.drag import Drag
from companion.files.yaml_file import ConfigError
from companion.identification import BadFitError, FitQuality, SecondOrderFit
from companion.program_command import program_command
from companion.recording.learned_file import LearnedFile
from tests.campaign.test_campaign_tune import FILE, Proposal, campaign, row_of
from tests.identification.test_fragment import PITCH, ROLL, VEHICLE

TUNE = FILE["tune"]


@pytest.fixture
def quick(connected, monkeypatch):
    """Candidates are flown by `row_of` on a worker in this process."""

    monkeypatch.setattr(command, "cluster_client", connected)
    monkeypatch.setattr("companion.campaign.tune.search.learned_config", lambda _: None)
    monkeypatch.setattr(candidates, "propose", lambda _: Proposal({}))
    monkeypatch.setattr(unit, "fly_case", row_of)


def tune(place, out, *more):
    return main(["campaign", "tune", str(place / "tuned.yaml"), "--out", str(out), *more])


def test_the_command_searches_goes_on_and_writes_what_it_found(tmp_path, quick, capsys):
    campaign(tmp_path)
    out = tmp_path / "a [bold] search"
    assert tune(tmp_path, out, "--trials", "4") == 0
    told = capsys.readouterr().out
    assert "checking on 3 flights that the search has not seen…\n" in told
    assert "4 candidates over 4 flights each" in told
    assert f"Written to {out / 'tuned.yaml'}; let your configuration include it.\n" in told
    first = load(out / "tuned.yaml").planner.gain_per_s
    assert 2.0 <= first <= 8.0
    assert tune(tmp_path, out, "--trials", "6") == 0
    assert "6 candidates over 4 flights each" in capsys.readouterr().out
    campaign(tmp_path, samples=3)
    assert tune(tmp_path, out) == 2
    assert "holds another campaign: samples differ" in capsys.readouterr().err


def test_a_search_without_a_good_candidate_says_what_to_widen(tmp_path, quick, capsys):
    campaign(tmp_path, tune=TUNE | {"envelope_m": 0.01, "trials": 2})
    out = tmp_path / "out"
    assert tune(tmp_path, out) == 1
    told = capsys.readouterr().out
    assert "None of the 2 candidates kept 99.9% of the flights inside the envelope" in told
    assert not (out / "tuned.yaml").exists()


@pytest.mark.parametrize(
    ("error", "code", "said"),
    [
        (KeyboardInterrupt(), 1, "interrupted; the candidates so far are kept. Continue with\n"),
        (ClusterError("[x] lost"), 1, "[x] lost; the candidates so far are kept. Continue with\n"),
        (VersionError("the worker has another"), 2, "companion: the worker has another\n"),
    ],
)
def test_what_ends_a_search_early_is_told(tmp_path, quick, monkeypatch, capsys, error, code, said):
    def run(*_):
        raise error

    monkeypatch.setattr(Search, "run", run)
    campaign(tmp_path)
    out = tmp_path / "out [b]"
    assert tune(tmp_path, out) == code
    told = capsys.readouterr()
    assert said in told.out + told.err
    again = f"  {program_command()} campaign tune {tmp_path / 'tuned.yaml'} --out '{out}'\n"
    assert (again in told.out) == (code == 1)
    assert tune(tmp_path, out, "--trials", "9") == code
    again = f" --out '{out}' --trials 9\n"
    assert (again in capsys.readouterr().out) == (code == 1)


def test_a_campaign_that_cannot_be_searched_is_refused(tmp_path, monkeypatch):
    batch = {"kind": "batch", "set": {"flight.maneuvers": ["corners"]}}
    with pytest.raises(ConfigError, match="`tune` needs `kind: flights`"):
        tune_section(campaign(tmp_path, **batch))
    several = {"a": {"uniform": [1, 2], "keys": ["planner.gain_per_s"]}}
    with pytest.raises(ConfigError, match="`times_base` and `keys` are allowed only in `sweep`"):
        tune_section(campaign(tmp_path, tune={"search": several}))
    monkeypatch.delitem(FILE, "tune")
    with pytest.raises(ConfigError, match="there is no section `tune`"):
        tune_section(campaign(tmp_path))


def test_a_damaged_storage_is_one_sentence(tmp_path, quick, capsys):
    campaign(tmp_path)
    out = tmp_path / "out"
    assert tune(tmp_path, out, "--trials", "1") == 0
    capsys.readouterr()
    (out / "tune.db").write_bytes(b"no database at all, " * 300)
    assert tune(tmp_path, out) == 2
    assert f"companion: {out / 'tune.db'}: cannot be used: " in capsys.readouterr().err


@pytest.fixture
def fill_disk():
    """A function after which SQLite gets no further page, as on a full disk."""
    is_full = []

    def on_checkout(connection, *_):
        if is_full:
            connection.execute("PRAGMA max_page_count = 1")

    event.listen(Pool, "checkout", on_checkout)
    yield lambda: is_full.append(True)
    event.remove(Pool, "checkout", on_checkout)


def test_a_disk_that_fills_during_the_search_ends_it_and_shows_the_best_so_far(
    tmp_path, quick, monkeypatch, capsys, fill_disk
):
    flown = []

    def row(case):
        flown.append(case)
        if len(flown) == 30:
            fill_disk()
        return row_of(case)

    monkeypatch.setattr(unit, "fly_case", row)
    campaign(tmp_path)
    out = tmp_path / "out"
    assert tune(tmp_path, out, "--trials", "200") == 1
    told = capsys.readouterr()
    assert "Traceback" not in told.err
    assert f"{out / 'tune.db'}: cannot be used: database or disk is full" in told.out
    assert (
        f"; the candidates so far are kept. Continue with\n  {program_command()} campaign tune"
        in told.out
    )
    assert "# The best candidate so far, not checked on unseen flights, RMS 0." in told.out
    assert "\nplanner:\n  gain_per_s: " in told.out


def test_a_result_that_cannot_be_written_is_shown(tmp_path, quick, monkeypatch, capsys):
    def full(path, _):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(path))

    monkeypatch.setattr(command, "write_whole", full)
    campaign(tmp_path)
    assert tune(tmp_path, tmp_path / "out", "--trials", "4") == 1
    told = capsys.readouterr()
    assert "4 candidates over 4 flights each" in told.out
    assert "\nplanner:\n  # " in told.out
    assert "No space left on device" in told.err


def test_a_vehicle_that_no_proposal_covers_starts_without_one(tmp_path, monkeypatch):
    def refuse(_):
        raise ConfigError("its rate loop is not known")

    made = campaign(tmp_path)
    learned = changed(made.base, {"planner": {"gain_per_s": 7.5}}, "a test")
    monkeypatch.setattr(candidates, "propose", refuse)
    found = list(start_candidates(made, tune_section(made), learned))
    assert [start.name for start in found] == ["the configuration", "a first flight"]
    assert found[1].values["planner.gain_per_s"] == 7.5


SEARCH = {
    "planner.name": SweptValues(choice=("exact", "so3")),
    "planner.gain_per_s": SweptValues(uniform=(2.0, 8.0)),
    "guidance.drag_per_s": SweptValues(loguniform=(0.2, 2.0)),
}


def test_candidates_near_a_start_stay_in_their_ranges_and_keep_what_is_no_number():
    values = {"planner.name": "so3", "planner.gain_per_s": 7.9, "guidance.drag_per_s": 0.21}
    found = [start.values for start in candidates_near(StartCandidate("x", values), SEARCH, 200, 1)]
    assert {each["planner.name"] for each in found} == {"so3"}
    gains = sorted(each["planner.gain_per_s"] for each in found)
    drags = sorted(each["guidance.drag_per_s"] for each in found)
    assert 2.0 <= gains[0] < 6.5
    assert gains[-1] == 8.0
    assert drags[0] == 0.2
    assert 0.3 < drags[-1] <= 2.0
    # 0.15 of the range is its standard deviation; in logarithms for the drag.
    assert sum(gain < 7.0 for gain in gains) == pytest.approx(200 * 0.159, abs=20)
    assert sum(drag > 0.21 * 10**0.15 for drag in drags) == pytest.approx(200 * 0.159, abs=20)


def test_values_that_are_not_among_the_choices_are_left_to_the_search():
    values = {"planner.name": "euler", "planner.gain_per_s": 9.0, "limits.max_climb_m_s": 1.0}
    assert clamped_to_search(values, SEARCH) == {"planner.gain_per_s": 8.0}


def test_suggestions_are_rounded_within_their_range():
    class Trial:
        def suggest_categorical(self, key, choices):
            return choices[-1]

        def suggest_float(self, key, low, high, *, log):
            assert log == (key == "guidance.drag_per_s")
            return low + 0.98765432 * (high - low)

    ranges = SEARCH | {"limits.max_climb_m_s": SweptValues(uniform=(0.0, 1.0001))}
    assert suggested_values(Trial(), ranges) == {
        "planner.name": "so3",
        "planner.gain_per_s": 7.93,
        "guidance.drag_per_s": 1.98,
        "limits.max_climb_m_s": 0.988,
    }


def test_a_candidate_whose_keys_do_not_fit_together_is_not_flown(tmp_path, monkeypatch):
    made = campaign(tmp_path)
    monkeypatch.setattr(candidates, "propose", lambda _: Proposal({}))
    fly = pytest.fail
    monkeypatch.setattr("companion.campaign.tune.search.learned_config", lambda _: None)
    search = Search(made, tune_section(made), tmp_path, fly)

    def refuse(*_):
        raise ConfigError("a minimum above a maximum")

    monkeypatch.setattr("companion.campaign.tune.search.cases", refuse)
    *_, found = search.run(2)
    assert (found.tried_count, found.stopped_early_count, found.best) == (2, 2, None)


def result(made, values, near_values, before, after):
    rows = [row_of(case) for case in made.cases()]
    good = score_of(rows, 1.0)
    best = Candidate(1, values, good)
    found = SearchResults(5, 0, best, [replace(best, values=each) for each in near_values])
    return CheckedResult(made, found, best, before or good, after or good, compare(good, good, 4))


def test_the_reasons_say_where_a_value_lies_among_the_best(tmp_path):
    searched = {
        "planner.name": {"choice": ["exact", "so3"]},
        "planner.gain_per_s": {"uniform": [2.0, 8.0]},
        "guidance.drag_per_s": {"uniform": [0.2, 2.0]},
        "limits.max_climb_m_s": {"uniform": [1.0, 2.0]},
    }
    made = campaign(tmp_path, tune=TUNE | {"search": searched})
    values = {
        "planner.name": "so3",
        "planner.gain_per_s": 8.0,
        "guidance.drag_per_s": 1.0,
        "limits.max_climb_m_s": 1.5,
    }
    others = values | {
        "planner.name": "exact",
        "guidance.drag_per_s": 1.2,
        "limits.max_climb_m_s": 1.1,
    }
    third = values | {"limits.max_climb_m_s": 1.9}
    told = result_text(
        result(made, values, [values, others, third], None, None), {"planner.name": "exact"}
    )
    reasons = [line for line in told.splitlines() if line.startswith("  #")]
    assert reasons == [
        "  # was exact; 2 of the best 3 candidates have this value",
        "  # was not set; the best 3 candidates have 8 to 8, searched from 2 to 8; this value "
        "lies at an end of the searched range: widen the range",
        "  # was not set; the best 3 candidates have 1 to 1.2, searched from 0.2 to 2",
        "  # was not set; the best 3 candidates have 1.1 to 1.9, searched from 1 to 2; this "
        "key matters little here",
    ]
    assert "The interval contains 1, so the result may not be better" in told


def test_flights_that_ended_early_are_told_and_with_too_few_nothing_is_compared(tmp_path):
    made = campaign(tmp_path)
    rows = [row_of(case) for case in made.cases()]
    ended = [row | {"result": "the fence was left"} for row in rows[:3]]
    few = score_of([*ended, rows[3]], 1.0)
    whole = score_of(rows, 1.0)
    assert compare(few, whole, 4) is None
    told = result(made, {}, [], few, whole)._replace(comparison=None)
    *_, early, nothing = summary_lines(told)
    assert early.startswith("Of 4 flights that the search has not seen, 3 ended early with the ")
    assert "and 0 with the result" in early
    assert nothing.startswith("Fewer than two samples were flown to their end with both")


class Flights:
    """Stands for the flights: `leaves` writes what a flight of the vehicle leaves behind."""

    def __init__(self, leaves=lambda _: None):
        self.leaves, self.flown = leaves, []

    def __call__(self, place, case, _):
        self.flown.append(case)
        self.leaves(place)


def test_first_flights_without_data_leave_the_configuration_as_it_is(tmp_path, monkeypatch):
    made = campaign(tmp_path)
    flights = Flights()
    monkeypatch.setattr(first_flight, "fly_in", flights)
    assert first_flight.learned_config(made) == made.base
    doublets, course = flights.flown
    assert doublets.config.flight.maneuvers == ("identify",)
    assert doublets.config.planner.name == "first-order"
    assert course == replace(next(made.cases()), fault=None)


def test_first_flights_teach_the_drag(tmp_path, monkeypatch):
    made = campaign(tmp_path)
    flights = Flights(lambda place: LearnedFile(place, "aa").save(Drag(0.4, 0.03), 5.0))
    monkeypatch.setattr(first_flight, "fly_in", flights)
    known = first_flight.learned_config(made)
    assert (known.guidance.drag_per_s, known.guidance.quadratic_drag_per_m) == (0.4, 0.03)


@pytest.mark.parametrize("damped", [False, True])
def test_first_flights_teach_the_response(tmp_path, monkeypatch, damped):
    """A second order is learned only where the search may set its damping."""
    quality = FitQuality(0.998, 0.02, 0.0003, 0.0004, 2.0, 500)
    nearer = SecondOrderFit(20.0, 0.75, 0.0084, 1.05, None, quality)
    seen = replace(
        VEHICLE, roll=replace(ROLL, second_order=nearer), pitch=replace(PITCH, second_order=nearer)
    )
    rows = SimpleNamespace(setpoints=1, rates=2, specific_thrust=3)
    monkeypatch.setattr(first_flight, "fly_in", Flights())
    monkeypatch.setattr(first_flight, "read_flight_log", lambda _: rows)
    monkeypatch.setattr(first_flight, "identify_vehicle", lambda *told: seen)
    search = TUNE["search"] | ({"vehicle.damping": {"uniform": [0.5, 1]}} if damped else {})
    vehicle = first_flight.learned_config(
        campaign(tmp_path, tune=TUNE | {"search": search})
    ).vehicle
    assert vehicle.damping == (0.75 if damped else None)
    assert vehicle.lag_ms == (75.0 if damped else 47.5)
    assert vehicle.yaw_lag_ms == 370.0


def test_a_response_that_cannot_be_fitted_is_not_learned(tmp_path, monkeypatch):
    def fail(*_):
        raise BadFitError("all axes are bad")

    rows = SimpleNamespace(setpoints=1, rates=2, specific_thrust=3)
    monkeypatch.setattr(first_flight, "fly_in", Flights())
    monkeypatch.setattr(first_flight, "read_flight_log", lambda _: rows)
    monkeypatch.setattr(first_flight, "identify_vehicle", fail)
    made = campaign(tmp_path)
    assert first_flight.learned_config(made) == made.base
