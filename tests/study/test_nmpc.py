"""`companion study nmpc`: its flights one by one, and, shortened, as a user runs it."""

import csv
import importlib.util
import re

import numpy as np
import pytest

from companion.attitude import Target
from companion.cli.main import main
from companion.study import registry
from companion.study.nmpc import findings, flights, timing
from companion.study.nmpc.flights import Flight, Vehicle
from companion.study.nmpc.variants import (
    CIRCLE,
    DRAG,
    EIGHT,
    MAX_ITERATIONS,
    MAX_TILT,
    MODELS,
    RATE_HZ,
    STYLES,
    UNLIMITED_MODELS,
    Variant,
)


def fly(task, who, seconds):
    flight = Flight(task, who)
    for _ in range(round(seconds * RATE_HZ)):
        flight.step()
    return flight


def test_the_vehicle_reaches_the_speed_at_which_drag_holds_its_thrust():
    vehicle = Vehicle()
    for _ in range(80):
        vehicle.fly(Target(0.3, -0.2, 0.0), 11.0, 0.1)
    upright = np.sqrt(1.0 - 0.3**2 - 0.2**2)
    wanted = np.array([11.0 * 0.3, -11.0 * 0.2, 9.80665 - 11.0 * upright]) / DRAG
    assert vehicle.velocity == pytest.approx(wanted, rel=5e-3)


def test_the_vehicle_answers_late_and_within_its_tilt():
    vehicle = Vehicle()
    vehicle.fly(Target(1.0, 0.0, 0.0), 9.80665, 0.04)
    assert vehicle.body.q == (1.0, 0.0, 0.0, 0.0)
    vehicle.fly(Target(1.0, 0.0, 0.0), 9.80665, 3.0)
    w, _, y, _ = vehicle.body.q
    assert -2.0 * y * w == pytest.approx(np.sin(MAX_TILT), abs=1e-3)


def test_from_a_standing_start_ours_settles_and_the_quaternion_runs_away():
    ours = fly(CIRCLE, Variant("limited"), 4.5)
    assert max(ours.errors) > 1.0
    assert max(ours.errors[-15:]) < 0.02
    other = fly(CIRCLE, Variant("quaternion", knows_dead_time=False), 3.0)
    assert other.errors[-1] > 3.0


def test_a_dead_time_that_is_known_is_predicted_past():
    known, unknown = (
        fly(EIGHT, Variant("proposed", knows_dead_time=known), 4.0).errors[-50:]
        for known in (True, False)
    )
    assert max(known) < 0.03
    assert np.mean(unknown) > 2.0 * np.mean(known)


@pytest.fixture(scope="module")
def out(tmp_path_factory):
    """The whole study, each flight for a second."""
    folder = tmp_path_factory.mktemp("nmpc")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(flights, "FLIGHT_S", 1)
        patch.setattr(flights, "SETTLED_AFTER_S", 0.5)
        patch.setattr(timing, "_REQUEST_COUNT", 20)
        patch.setattr("companion.study.nmpc.study.PROGRESS_STEPS", 3)
        assert main(["study", "nmpc", "--out", str(folder)]) == 0
    return folder


def rows(out, name):
    with (out / f"{name}.csv").open(newline="") as file:
        return list(csv.DictReader(file))


@pytest.mark.slow
def test_every_model_is_timed_by_one_iteration_and_to_the_end(out):
    labels = [style.label for style in STYLES.values()]
    table = rows(out, "nmpc")
    assert [row["model"] for row in table] == labels
    for row in table:
        times = [float(value) for name, value in row.items() if name.endswith("ms")]
        assert len(times) == 4
        assert times[0] <= times[1]
        assert 0.0 < times[2] <= times[3]
        assert 1.0 <= float(row["iterations: mean"]) <= float(row["iterations: most"])
    assert len(rows(out, "nmpc-error")) == 9


@pytest.mark.slow
def test_from_cold_ours_converges_from_every_state(out):
    *_, ours = table = rows(out, "nmpc-cold-start")
    assert [row.pop("model") for row in table] == [style.label for style in STYLES.values()]
    assert len(ours) == 5
    assert all(2 <= float(count) < 20 for count in ours.values())
    assert table[0]["the wrong way"] == "inf"


@pytest.mark.slow
def test_the_tables_of_errors_are_those_of_the_flights(out):
    flights = rows(out, "nmpc-flights")
    assert len(flights) == 23 * RATE_HZ
    mine = [
        float(row["error, m"])
        for row in flights
        if (row["task"], row["model"], row["most iterations"])
        == ("eight", STYLES["limited"].label, "1")
    ]
    (row,) = [row for row in rows(out, "nmpc-error") if row["model"] == STYLES["limited"].label]
    late = np.array(mine[25:])
    assert float(row["eight: RMS, m"]) == pytest.approx(np.sqrt(np.mean(late**2)))
    assert mine == pytest.approx(fly(EIGHT, Variant("limited"), 1.0).errors, abs=1e-6)


@pytest.mark.slow
def test_the_whole_answer_of_the_process_takes_longer_than_its_solve(out):
    whole, solve = rows(out, "nmpc-exchange")
    assert 0.0 < float(solve["p50, ms"]) < float(whole["p50, ms"])


@pytest.mark.slow
def test_the_page_has_every_finding_and_the_paper_s_claim(out):
    text = (out / "nmpc.html").read_text()
    assert len(re.findall(r'class="(?:holds|fails)">', text)) == 8
    assert 'id="nmpc"' in text
    assert (out / "nmpc.png").read_bytes().startswith(b"\x89PNG")


class Flown:
    """A flight whose solves took so long, and whose error was this all the time."""

    def __init__(self, milliseconds=2.0, error=0.01):
        self.errors, self.rms = [error] * 300, error
        self.solve_ms = lambda share: milliseconds


def flights_of(milliseconds=None, errors=None, unknown=0.05):
    """Every model alike, but for what is given by model."""
    known = {
        (task.name, Variant(model, most)): Flown(
            (milliseconds or {}).get(model, 2.0), (errors or {}).get(model, 0.01)
        )
        for task in (CIRCLE, EIGHT)
        for model in MODELS
        for most in (1, MAX_ITERATIONS)
    }
    less = {
        (EIGHT.name, Variant(model, knows_dead_time=False)): Flown(2.0, unknown)
        for model in UNLIMITED_MODELS
    }
    return {**known, **less}


ALIKE = {model: {"a state": 9.0} for model in MODELS}
FAR = ALIKE | {model: {"a state": np.inf} for model in UNLIMITED_MODELS}
QUICK = timing.ProcessTimes(np.full(99, 5.0), np.full(99, 4.0), 0)


@pytest.mark.parametrize(
    ("words", "flown", "counts", "timed", "holds"),
    [
        ("faster than Euler (37)", flights_of({"proposed": 1.9}), ALIKE, QUICK, True),
        ("faster than Euler (37)", flights_of({"quaternion": 1.9}), ALIKE, QUICK, False),
        ("faster than Euler by", flights_of({"proposed": 1.9}), ALIKE, QUICK, True),
        ("faster than Euler by", flights_of({"euler-reduced": 1.9}), ALIKE, QUICK, False),
        ("from more states", flights_of(), ALIKE | {"euler": {"a state": np.inf}}, QUICK, False),
        ("from more states", flights_of(), FAR, QUICK, True),
        ("ours: (34) with limits settles", flights_of(), ALIKE, QUICK, True),
        (
            "ours: (34) with limits settles",
            flights_of(errors={"limited": 0.2}),
            ALIKE,
            QUICK,
            False,
        ),
        ("proposed (34) settles", flights_of(errors={"proposed": 0.2}), ALIKE, QUICK, False),
        ("past the dead time", flights_of(), ALIKE, QUICK, True),
        ("past the dead time", flights_of(unknown=0.009), ALIKE, QUICK, False),
        ("smallest error", flights_of(errors={"limited": 0.009}), ALIKE, QUICK, True),
        ("smallest error", flights_of(errors={"euler": 0.009}), ALIKE, QUICK, False),
        ("answers within 10 ms", flights_of(), ALIKE, QUICK, True),
        (
            "answers within 10 ms",
            flights_of(),
            ALIKE,
            QUICK._replace(answer_ms=np.full(9, 11.0)),
            False,
        ),
        ("answers within 10 ms", flights_of(), ALIKE, QUICK._replace(bad_answer_count=1), False),
    ],
)
def test_a_verdict_is_made_of_the_numbers(words, flown, counts, timed, holds):
    (finding,) = [
        one for one in findings.make_findings(flown, counts, timed) if words in one.statement
    ]
    assert finding.holds is holds


def test_the_studies_of_every_machine_go_without_it(tmp_path, monkeypatch, capsys):
    assert "nmpc" not in [study.name for study in registry.selected_studies("all")]
    found = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name: None if name == "casadi" else found(name)
    )
    assert main(["study", "nmpc", "--out", str(tmp_path)]) == 2
    said = capsys.readouterr().err
    assert "[nmpc]'" in said
    assert said.count("\n") == 1
