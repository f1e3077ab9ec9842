"""`companion study track`: some of its flights, and its page made of flights that were made up."""

import csv
import json
import os
import re
import signal
import subprocess
import sys
import time
from contextlib import suppress
from math import inf

import numpy as np
import psutil
import pytest
import yaml

from companion.attitude import PLANNER_NAMES
from companion.cli.main import main
from companion.config.files import shipped
from companion.files.yaml_file import ConfigError
from companion.study import report
from companion.study.track import flights, study
from companion.study.track.findings import make_findings
from companion.study.track.flights import PositionError, TrackedFlight
from companion.study.track.tasks import WINDY, Task, TrajectoryAtSpeed, tasks

OURS = "model-following"
BRIEF = TrajectoryAtSpeed("figure-eight", 4.0, 1.0)
TASKS = (Task(BRIEF, OURS), Task(BRIEF, OURS, lead=False), Task(BRIEF, OURS, wind=WINDY))


@pytest.fixture(scope="module")
def flown():
    """Three flights, side by side; and what was ticked."""
    ticked = []
    return flights.fly_all(TASKS, ticked.append), ticked


@pytest.fixture
def vehicle(tmp_path, monkeypatch):
    """Makes the vehicle that ships another one."""

    def changed(**mock):
        file = shipped("mock-px4.yaml")
        content = yaml.safe_load(file.read_text())
        content["include"] = str(file.with_name(content["include"]))
        content["mock"] |= mock
        path = tmp_path / "other.yaml"
        path.write_text(yaml.safe_dump(content))
        monkeypatch.setattr(flights, "shipped", lambda _: path)

    return changed


@pytest.mark.slow
def test_a_trajectory_is_followed_closely_only_if_led(flown):
    with_lead, without_lead, windy = (flown[0][task] for task in TASKS)
    assert with_lead.result == "ok"
    assert with_lead.telemetry_error.rms < 0.04
    assert with_lead.telemetry_error.rms < with_lead.telemetry_error.largest < 0.1
    assert without_lead.telemetry_error.rms > 3.0 * with_lead.telemetry_error.rms
    assert 2.0 * with_lead.telemetry_error.rms < windy.telemetry_error.rms < 0.15


@pytest.mark.slow
def test_the_course_is_measured_and_nothing_else(flown):
    path = flown[0][TASKS[0]].path
    assert np.ptp(path[:, :2], axis=0) == pytest.approx([6.0, 3.0], abs=0.01)
    assert np.linalg.norm(path[-1, :2] - path[0, :2]) < 0.02
    steps = np.linalg.norm(np.diff(path[:, :2], axis=0), axis=1)
    assert steps.max() == pytest.approx(4.0 * 0.02, rel=0.03)
    assert (steps == 0.0).sum() < 5  # it neither holds before nor after


@pytest.mark.slow
def test_the_truth_is_that_of_the_vehicle_at_the_same_time(vehicle):
    """Told without noise and without delay, the two are one."""
    names = ("attitude_noise_deg", "rate_noise_rad_s", "position_noise_m", "velocity_noise_m_s")
    vehicle(sensors={**dict.fromkeys(names, 0.0), "position_delay_ms": 0.0, "ekf": "none"})
    tracked = flights.fly(TASKS[0])
    assert tracked.telemetry_error.rms == pytest.approx(tracked.true_error.rms, abs=2e-3)
    assert tracked.true_error.rms < 0.03


@pytest.mark.slow
def test_each_flight_is_told_as_it_begins(flown):
    assert flown[1] == [
        "figure-eight, 4 m/s, model-following",
        "figure-eight, 4 m/s, model-following, without lead",
        "figure-eight, 4 m/s, model-following in 3 m/s of wind",
    ]


@pytest.mark.slow
def test_a_flight_is_the_same_to_the_bit_in_company_and_alone(flown):
    alone, company = flights.fly(TASKS[0]), flown[0][TASKS[0]]
    assert (alone.telemetry_error, alone.true_error) == (
        company.telemetry_error,
        company.true_error,
    )
    assert np.array_equal(alone.path, company.path)


@pytest.mark.slow
def test_a_flight_that_fails_has_no_error_to_show(vehicle):
    vehicle(faults=[{"kind": "gps_loss", "after_offboard_s": 2.5}])
    tracked = flights.fly(TASKS[0])
    assert tracked.result not in ("ok", "")
    assert (tracked.telemetry_error, tracked.true_error) == (
        PositionError(inf, inf),
        PositionError(inf, inf),
    )


def test_what_cannot_be_flown_ends_the_study_before_more_is_begun(monkeypatch):
    monkeypatch.setattr(flights, "usable_cores", lambda: 1)
    ticked = []
    too_fast = [Task(TrajectoryAtSpeed("circle", 50.0, 1.0), planner) for planner in PLANNER_NAMES]
    many = [task._replace(wind=wind) for task in too_fast for wind in range(9)]
    with pytest.raises(ConfigError, match=r"limits\.max_tilt_rate_deg_s allows 250"):
        flights.fly_all(many, ticked.append)
    assert len(ticked) == 1


def made_up(**others):
    """Flights of the whole study that were not flown; `others` are errors of ours, by text."""
    rank = {planner: n for n, planner in enumerate(PLANNER_NAMES)}
    flown = {}
    for task in tasks():
        rms = 1e-3 * (20.0 + rank[task.planner] + task.trajectory.speed) + 0.01 * task.wind
        if task.planner == OURS:
            rms *= 0.5 if task.lead else 5.0
        rms = others.get(str(task), rms)
        path = np.linspace((0.0, 0.0, 0.0, 0.1), (1.0, 2.0, 1.1, 2.1), 50)
        telemetry = PositionError(rms, 2.0 * rms)
        truth = PositionError(0.9 * rms, 1.8 * rms)
        flown[task] = TrackedFlight("ok" if rms < inf else "lost", telemetry, truth, path)
    return flown


def studied(monkeypatch, capsys, out, *options, **others):
    monkeypatch.setattr(study, "fly_all", lambda _, tick: made_up(**others))
    assert main(["study", "track", "--out", str(out), *options]) == 0
    return capsys.readouterr()


def table(out, name):
    with (out / f"{name}.csv").open(newline="") as file:
        header, *body = csv.reader(file)
    return {row[0]: dict(zip(header[1:], row[1:], strict=True)) for row in body}


def test_json_prints_one_list_and_the_tables_hold_what_was_flown(tmp_path, monkeypatch, capsys):
    said = studied(monkeypatch, capsys, tmp_path, "--json")
    rows = json.loads(said.out)
    assert "Open" in said.err
    case = ("trajectory", "speed_mps", "planner", "guidance", "wind_mps")
    cases = [tuple(row[key] for key in case) for row in rows]
    assert len(cases) == len(set(cases))
    assert {row[2] for row in cases} == set(PLANNER_NAMES)
    for planner in PLANNER_NAMES:
        calm = [row[:2] for row in cases if row[2:] == (planner, "linear", 0.0)]
        assert calm == [
            *(("circle", speed) for speed in (1.0, 3.0, 5.0, 7.0)),
            *(("figure-eight", speed) for speed in (1.0, 3.0, 5.0)),
        ]
    assert {row[2] for row in cases if row[4] == 3.0} == {OURS, "first-order"}
    (row,) = [
        row
        for row, of in zip(rows, cases, strict=True)
        if of == ("circle", 5.0, OURS, "linear", 0.0)
    ]
    assert row["position_rms_m"] == pytest.approx(0.5 * 0.030)
    assert row["position_max_m"] == pytest.approx(0.030)
    assert row["true_rms_m"] == pytest.approx(0.9 * 0.015)
    assert row["not_led_rms_m"] == pytest.approx(0.15)
    assert row["not_led_max_m"] == pytest.approx(0.30)
    assert row["result"] == "ok"
    row = table(tmp_path, "track")["circle, 7 m/s, linear"]
    assert float(row["first-order"]) == pytest.approx(27.0)
    assert float(row[OURS]) == pytest.approx(0.5 * 32.0)
    assert float(table(tmp_path, "track-largest")["circle, 7 m/s, linear"]["exact"]) == 56.0
    true = table(tmp_path, "track-true")["figure-eight, 1 m/s, linear"]
    assert float(true["first-order"]) == pytest.approx(0.9 * 21.0)
    wind = table(tmp_path, "track-lead-and-wind")["figure-eight, 5 m/s"]
    assert [float(wind[key]) for key in wind] == pytest.approx([15.0, 150.0, 30.0, 300.0, 55.0])


def test_the_findings_follow_from_the_numbers():
    def verdicts(**others):
        return [finding.holds for finding in make_findings(made_up(**others))]

    assert verdicts() == [True] * 6
    assert verdicts(**{"circle, 3 m/s, model-following": 0.0231})[:2] == [True, True]  # even
    assert verdicts(**{"circle, 3 m/s, model-following": 0.0233})[:2] == [False, False]
    windy = "figure-eight, 1 m/s, model-following in 3 m/s of wind"
    assert verdicts(**{windy: 0.2}) == [True, True, False, True, True, True]
    calm = "circle, 5 m/s, model-following, without lead"
    assert verdicts(**{calm: 0.04}) == [True, True, True, False, True, True]
    assert verdicts(**{f"{calm} in 3 m/s of wind": 0.07}) == [True, True, True, True, False, True]
    windy = "figure-eight, 5 m/s, model-following in 3 m/s of wind"
    assert not verdicts(**{windy: 0.13})[-1]
    beaten = make_findings(made_up(**{"circle, 3 m/s, model-following": 0.0233}))[0].evidence
    assert "circle, 3 m/s: 23.3 mm, first-order 23.0 mm" in beaten
    assert "on 6 of 7 trajectories; on 1 another planner is better" in beaten


def test_a_flight_that_failed_is_told_as_such_everywhere(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(report, "_image", lambda *_: b"")  # the test above paints this figure
    lost = {"circle, 7 m/s, model-following": inf, "circle, 7 m/s, euler": inf}
    said = studied(monkeypatch, capsys, tmp_path, "--json", **lost)
    failed = [row for row in json.loads(said.out) if row["result"] != "ok"]
    assert [row["planner"] for row in failed] == ["euler", OURS]
    for row in failed:
        assert row["position_rms_m"] is row["true_max_m"] is None
    assert table(tmp_path, "track")["circle, 7 m/s, linear"][OURS] == "failed"
    text = (tmp_path / "track.html").read_text()
    assert "circle, 7 m/s: failed, first-order 27.0 mm" in text
    assert not {"nan", "None", "inf"} & set(re.findall(r"<td[^>]*>([^<]*)</td>", text))


def test_json_goes_with_this_study_alone(tmp_path, capsys):
    assert main(["study", "kmax", "--json", "--out", str(tmp_path)]) == 2
    said = capsys.readouterr()
    assert "--json needs study track" in said.err
    assert "--json needs study track" in json.loads(said.out)["result"]
    assert not list(tmp_path.iterdir())


SHORT = """
import sys
from companion.cli.main import main
from companion.study.track import study, tasks
arc = tasks.TrajectoryAtSpeed(tasks.CIRCLE, 2.0, 0.1)
arcs = [tasks.Task(arc, name) for name in tasks.PLANNER_NAMES]
study.tasks = lambda: arcs
if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
"""
"""The command, with flights for which it does not have to wait long."""


@pytest.mark.slow
def test_interrupted_it_leaves_no_flight_behind(tmp_path):
    command = [sys.executable, "-c", SHORT, "study", "track", "--out", str(tmp_path)]
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
    )

    def workers():
        family = psutil.Process(process.pid).children(recursive=True)
        with suppress(psutil.Error):  # one of them has ended meanwhile
            return [one for one in family if "--multiprocessing-fork" in one.cmdline()]
        return []

    deadline = time.monotonic() + 30.0
    while not (left := workers()):
        assert time.monotonic() < deadline
        time.sleep(0.05)
    os.killpg(process.pid, signal.SIGINT)
    out, errors = process.communicate(timeout=60.0)
    assert process.returncode == 1
    assert "Interrupted" in out
    assert "Traceback" not in out + errors
    _, alive = psutil.wait_procs(left, timeout=10.0)
    assert not alive
    assert not list(tmp_path.iterdir())
