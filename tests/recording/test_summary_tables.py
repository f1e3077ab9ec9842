"""The table at the end of a flight says what was measured, and fits a terminal."""

import io
import math
from dataclasses import replace

import pytest
from rich.console import Console

from companion.recording.measurements.dead_time import AxisDeadTime, DeadTimes, SampleAge
from companion.recording.measurements.flight_facts import FlightFacts
from companion.recording.measurements.summary import LoopCounts, PredictiveFigures, Summary
from companion.recording.summary_tables import flight_table
from companion.recording.trace import FlightTrace
from tests.recording.test_summary import trace_in_wind, trace_of

AS_CONFIGURED = DeadTimes(
    {
        "roll": AxisDeadTime(0.0421, 0.04),
        "pitch": AxisDeadTime(0.0419, 0.04),
        "yaw": AxisDeadTime(None, 0.102),
    },
    SampleAge(0.0021, 0.0048),
    lag_known=True,
)


COUNTS = LoopCounts(7, 6, 1)


def table(trace, dead_times=AS_CONFIGURED, counts=COUNTS):
    """The rows of the table as a user sees them, without its lines."""
    trace.rates.add([1.0, 2.0, 0.1, 0.2, 0.3, 0.5, 0.0, 0.0, 0.0, 0.003])
    summary = Summary("ok", "disarm", "exact", 5.0, counts, {}, trace, dead_times=dead_times)
    out = io.StringIO()
    Console(file=out, width=80).print(flight_table(summary))
    assert max(len(line) for line in out.getvalue().splitlines()) <= 80
    return [" ".join(line.strip("│ ").split()) for line in out.getvalue().splitlines()]


def cells(lines, name):
    """What stands beside `name`."""
    (line,) = [line for line in lines if line.startswith(f"{name} │")]
    return [cell.strip() for cell in line.split("│")[1:]]


def test_straightness_and_the_nearest_second_order_stand_in_it():
    trace = trace_of(0.25, bend=0.02)
    lines = table(trace)
    response = Summary("ok", "", "exact", 5.0, LoopCounts(), {}, trace).response()
    straightness = cells(lines, "straightness: largest distance from a step's line")
    assert straightness == [f"{response.cross_axis_max:.4f}", "0"]
    model = response.second_order
    assert cells(lines, "nearest second order: frequency ω")[0] == f"{model.frequency:.1f} rad/s"
    assert cells(lines, "damping ζ")[0] == f"{model.damping:.2f}"
    assert cells(lines, "dead time")[0] == f"{1e3 * model.dead_time:.0f} ms"
    deviation = cells(lines, "largest deviation from this model")[0]
    assert float(deviation) == pytest.approx(response.second_order_deviation_max, abs=1e-4)


def test_an_axis_that_no_step_moved_was_not_flown():
    lines = table(trace_in_wind())
    assert cells(lines, "time constant east")[0] == "not flown"
    assert cells(lines, "time constant north")[0].endswith(" s")


def test_without_a_maneuver_there_is_no_rate_in_the_maneuvers():
    assert "6 setpoints for 7 samples" in table(FlightTrace())
    told = table(FlightTrace(), counts=LoopCounts(7, 6, 1, rate_hz=250.0))
    assert "6 setpoints for 7 samples, 250 Hz in the maneuvers" in told


def test_the_reasons_of_unanswered_samples_stand_below_it():
    unanswered = {"late": 2, "not_newer": 0, "awaiting_mode": 1}
    lines = table(FlightTrace(), counts=LoopCounts(9, 6, 1, 3, unanswered=unanswered))
    assert "unanswered samples: 2 late, 1 awaiting mode" in lines
    assert not any("unanswered" in line for line in table(FlightTrace()))


def test_dead_times_stand_beside_what_was_configured():
    lines = table(FlightTrace())
    assert cells(lines, "roll") == ["42 ms", "40 ms"]
    assert cells(lines, "yaw") == ["not enough rotation to measure", "102 ms"]
    assert cells(lines, "of which sample age (p50, p99)")[0] == "2.1, 4.8 ms"
    assert "not as configured" not in " ".join(lines)


def test_a_wrong_dead_time_stands_beside_the_configured_one():
    wrong = DeadTimes({**AS_CONFIGURED.axes, "pitch": AxisDeadTime(0.08, 0.04)}, lag_known=True)
    lines = table(FlightTrace(), wrong)
    assert cells(lines, "pitch") == ["80 ms", "40 ms"]
    assert not any("sample's age" in line for line in lines)  # the clocks were never compared


def test_without_a_lag_it_says_where_one_comes_from():
    lines = table(FlightTrace(), DeadTimes())
    assert "vehicle.lag_ms is not set (`companion identify` finds it)" in " ".join(lines)
    assert not any(line.startswith("roll") for line in lines)
    assert math.isnan(DeadTimes().sample_age.p50)


def test_each_maneuver_has_its_row():
    trace = FlightTrace()
    trace.begin_maneuver(0.0, 0.0, "hover")
    for k in range(100):
        trace.tracking.add([0.1 * k, 0.0, 0.0, -5.0, 0.03, 0.04, -5.02])
    trace.begin_maneuver(10.0, 10.0, "steps")
    for k in range(100):
        trace.tracking.add([10.0 + 0.1 * k, math.nan, math.nan, -5.0, 0.02 * k, 0.0, -5.01])
    lines = table(trace)
    assert cells(lines, "hover") == ["0.05 m", "0.05 m", "0.02 m", "0.02 m"]
    assert cells(lines, "steps") == ["open loop", "1.98 m of drift", "0.01 m", "0.01 m"]


def test_in_lockstep_no_latency_and_no_deadline_is_shown():
    def words(lockstep):
        facts = FlightFacts(lockstep=lockstep)
        return text_of(Summary("ok", "", "exact", 5.0, COUNTS, {}, FlightTrace(), facts=facts))

    for sign in ("sample in → setpoint out", "deadline", "Control loop"):
        assert sign in words(False)
        assert sign not in words(True)
    assert "6 setpoints for 7 samples" in words(True)


def text_of(summary):
    out = io.StringIO()
    Console(file=out, width=80).print(flight_table(summary))
    return " ".join(out.getvalue().split())


def test_a_flight_without_samples_has_no_table():
    assert text_of(Summary("ok", "", "exact", 5.0, LoopCounts(), {}, FlightTrace())) == ""


def test_a_step_that_was_cut_short_is_told_as_that():
    trace = FlightTrace()
    trace.response.add([1.0, 1.0, 0.0, 0.0, 0.0, 0.1, 0.0])
    told = text_of(Summary("ok", "", "exact", 5.0, LoopCounts(), {}, trace))
    assert told == "no acceleration step was flown to its end"


def test_predictive_control_is_counted_with_what_it_left_to_linear_guidance():
    def told(figures):
        summary = Summary("ok", "", "exact", 5.0, LoopCounts(), {}, FlightTrace())
        return text_of(replace(summary, predictive=figures))

    assert told(PredictiveFigures(3, {"late": 2, "failed": 1}, (0.001, 0.002, 0.009))) == (
        "predictive control: 3 answers flown, computed in 2.0 ms (p99 8.9 ms); linear guidance "
        "replaced 3 other answers: 2 late, 1 failed"
    )
    assert told(PredictiveFigures(0, {}, ())) == "predictive control: 0 answers flown"
