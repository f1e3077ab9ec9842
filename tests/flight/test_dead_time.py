"""The dead time measured all the time: in flight, at its end, and what is said when it is wrong."""

import math

import numpy as np
import pytest

from companion.config.files import load
from companion.config.vehicle import AxisKeys
from companion.flight import dead_time_watch
from companion.flight.dead_time_watch import DeadTimeWatch
from companion.recording.flight_record import read_flight
from companion.recording.measurements.recorded_summary import trace_of
from companion.recording.trace import FlightTrace
from tests.flight import tlog
from tests.flight.fly import fly, mock_vehicle
from tests.identification.vehicles import RATE_NOISE, lag_with_dead_time

PERIOD, LAG = 0.004, 0.047
TILT, YAW = AxisKeys(1e3 * LAG, 40.0, None, None), AxisKeys(100.0, 80.0, None, None)
UNKNOWN = AxisKeys(None, None, None, None)


class Bench:
    """A watch and its flight's rows; the vehicle's clock is 7 s behind ours."""

    def __init__(self, tilt=TILT, yaw=YAW):
        self.trace, self.notes, self.now = FlightTrace(), [], 0.0
        self.watch = DeadTimeWatch(self.trace, {"roll": tilt, "pitch": tilt, "yaw": yaw}, self.note)

    def note(self, text):
        self.notes.append((self.now, text))

    def fly(self, commanded, measured, age=0.003):
        """Rows (n, 3) of roll, pitch and yaw rates; samples are `age` s (or each its own) old."""
        ages = np.broadcast_to(age, len(commanded)).tolist()
        for asked, got, old in zip(commanded.tolist(), measured.tolist(), ages, strict=True):
            self.now += PERIOD
            stamp = self.now - 7.0 - np.nan_to_num(old)
            self.trace.rates.add([stamp, self.now, *asked, 0.5, *got, old])
            self.watch.after_setpoint(self.now)


def turns(seconds, dead_times, amplitude=0.5, seed=1):
    """Commands such as a planner gives, and the rates that follow, each axis with its own noise."""
    rng = np.random.default_rng(seed)
    times = PERIOD * np.arange(round(seconds / PERIOD))
    knots = np.arange(0.0, seconds + 1.0, 0.4)
    commanded, measured = [], []
    for dead_time, loop in zip(dead_times, (TILT, TILT, YAW), strict=True):
        asked = amplitude * np.interp(times, knots, rng.normal(size=knots.size))
        got = lag_with_dead_time(times, asked, loop.lag, dead_time)
        commanded.append(asked)
        measured.append(got + rng.normal(0.0, RATE_NOISE, times.size))
    return np.transpose(commanded), np.transpose(measured)


def test_each_axis_is_measured_behind_its_own_lag():
    bench = Bench()
    bench.fly(*turns(20.0, (0.04, 0.045, 0.08)))
    found = bench.watch.measure_whole_flight()
    measured = [axis.measured for axis in found.axes.values()]
    assert measured == pytest.approx([0.04, 0.045, 0.08], abs=0.003)
    assert [axis.configured for axis in found.axes.values()] == [0.04, 0.04, 0.08]
    assert found.lag_known
    assert bench.notes == []


def test_a_link_that_becomes_slow_in_flight_is_told_once():
    bench = Bench()
    bench.fly(*turns(30.0, (0.04, 0.04, 0.08)))
    assert bench.notes == []
    bench.fly(*turns(18.0, (0.08, 0.08, 0.12), seed=2))
    ((when, text),) = bench.notes
    assert 32.0 < when < 46.0
    assert "dead time is not as configured" in text
    bench.watch.measure_whole_flight()
    assert len(bench.notes) == 1


def test_an_acceleration_limit_is_taken_out_too():
    record = turns(12.0, (0.04, 0.04, 0.08), amplitude=2.0)
    times = PERIOD * np.arange(len(record[0]))
    shaped = lag_with_dead_time(times, record[0][:, 0], LAG, 0.04, slew=8.0)
    record[1][:, 0] = shaped
    bench = Bench(tilt=TILT._replace(acceleration_limit_deg_s2=math.degrees(8.0)))
    bench.fly(*record)
    assert bench.watch.measure_whole_flight().axes["roll"].measured == pytest.approx(
        0.04, abs=0.003
    )


def test_what_only_the_whole_flight_shows_is_told_at_its_end():
    bench = Bench()
    bench.fly(*turns(8.0, (0.08, 0.04, 0.08)))
    assert bench.notes == []
    bench.watch.measure_whole_flight()
    ((_, text),) = bench.notes
    assert "roll 80 ms (configured 40 ms);" in text


def test_one_look_that_finds_it_wrong_is_not_yet_believed(monkeypatch):
    """Looks take turns: roll, pitch, yaw, roll and so on."""
    answers = iter([0.08, 0.04, 0.04, 0.04, 0.08, 0.08, 0.08, None, 0.08])
    bench, looks = Bench(yaw=TILT), []

    def answer(*_):
        looks.append((bench.now, len(bench.notes)))
        return next(answers)

    monkeypatch.setattr(dead_time_watch, "dead_time_by_correlation", answer)
    while len(looks) < 9:
        bench.fly(np.zeros((1, 3)), np.zeros((1, 3)))
    when, told_before = zip(*looks, strict=True)
    assert set(told_before) == {0}  # though roll was wrong twice, with one right between
    ((_, text),) = bench.notes
    assert "yaw 80 ms" in text
    assert when[0] == pytest.approx(6.0, abs=0.1)
    assert np.diff(when) == pytest.approx(2.0, abs=0.01)


def test_what_the_autopilot_did_after_it_took_over_unheard_does_not_count():
    bench = Bench()
    bench.fly(*turns(12.0, (0.04, 0.04, 0.08), amplitude=0.1))
    commanded, _ = turns(1.0, (0.04, 0.04, 0.08), seed=3)
    bench.fly(commanded, 2.0 * commanded)  # as it happens, it does the like at once
    measured = [axis.measured for axis in bench.watch.measure_whole_flight().axes.values()]
    assert measured == pytest.approx([0.04, 0.04, 0.08], abs=0.005)


def test_a_hover_does_not_tell_and_is_not_guessed_from():
    bench = Bench()
    bench.fly(*turns(16.0, (0.08, 0.08, 0.2), amplitude=0.003))
    found = bench.watch.measure_whole_flight()
    assert [axis.measured for axis in found.axes.values()] == [None, None, None]
    assert bench.notes == []


def test_without_a_lag_nothing_is_measured():
    bench = Bench(UNKNOWN, UNKNOWN)
    bench.fly(*turns(12.0, (0.08, 0.08, 0.2)))
    found = bench.watch.measure_whole_flight()
    assert not found.lag_known
    assert [axis.measured for axis in found.axes.values()] == [None, None, None]


def test_the_age_of_samples_is_that_of_their_arrival():
    still = np.zeros((2000, 3))
    ages = np.where(np.arange(2000) % 50 == 0, 0.030, 0.004)
    bench = Bench()
    bench.fly(still, still, ages)
    found = bench.watch.measure_whole_flight().sample_age
    assert found == pytest.approx((0.004, 0.030), abs=1e-6)


def test_without_timesync_no_age_is_told():
    still = np.zeros((2000, 3))
    bench = Bench()
    bench.fly(still, still, math.nan)
    assert all(math.isnan(value) for value in bench.watch.measure_whole_flight().sample_age)


def test_the_yaml_gives_each_axis_its_response_in_si(tmp_path):
    path = tmp_path / "vehicle.yaml"
    path.write_text(
        "vehicle: {lag_ms: 20, dead_time_ms: 15, acceleration_limit_deg_s2: 1100, yaw_lag_ms: 64,\n"
        "  damping: 0.7}\n"
    )
    roll, pitch, yaw = load(path).vehicle.axes.values()
    assert (roll.lag, roll.dead_time) == (0.02, 0.015)
    assert (roll.acceleration_limit, roll.damping) == (math.radians(1100), 0.7)
    assert pitch == roll
    assert (yaw.lag, yaw.dead_time) == (0.064, 0.015)
    assert (yaw.acceleration_limit, yaw.damping) == (math.radians(1100), None)
    path.write_text("flight: {takeoff_height_m: 5}\n")
    assert set(load(path).vehicle.axes.values()) == {UNKNOWN}


PX4 = {"lag_ms": 47, "dead_time_ms": 40, "yaw_lag_ms": 370, "yaw_dead_time_ms": 102}


def flown(folder, maneuvers, **fault):
    """The summary of a flight on PX4's measured response, with 40 ms more in one direction.

    Without a folder nothing is recorded.
    """
    faults = [{"kind": "delay", "delay_ms": 40, **fault}] if fault else []
    with mock_vehicle(seed=3, faults=faults, in_lockstep=True) as mock:
        flight = {"maneuvers": [maneuvers], "takeoff_height_m": 3.0}
        summary = fly(mock, folder, vehicle=PX4, flight=flight)
    assert summary.result == "ok", summary.events
    return summary


def warnings(summary):
    return [time for time, text in summary.events if "dead time is not as configured" in text]


def test_a_flight_measures_what_is_configured_and_keeps_its_rates(tmp_path):
    summary = flown(tmp_path, "corners")
    told = summary.as_dict()["dead_time_s"]
    assert (told["roll"], told["pitch"]) == pytest.approx((0.04, 0.04), abs=0.004)
    assert told["yaw"] == pytest.approx(0.102, rel=0.2)
    assert warnings(summary) == []
    asked = {}
    for message in tlog.messages(summary, "SET_ATTITUDE_TARGET"):
        rates = message.body_roll_rate, message.body_pitch_rate, message.body_yaw_rate
        asked[message.time_boot_ms] = (*rates, message.thrust)
    rows = trace_of(read_flight(summary.log)).rates.rows()
    assert len(rows) > 1200
    sent = [asked[round(1000 * time)] for time in rows[:, 0]]
    assert rows[:, 2:6] == pytest.approx(np.array(sent), abs=1e-6)
    assert len(rows) < len(asked) - 200  # on the ground and in the climb nobody obeyed


@pytest.mark.parametrize(
    ("direction", "age"),
    [("to_companion", 0.04), pytest.param("from_companion", 0.0, marks=pytest.mark.slow)],
)
def test_a_slow_link_shows_as_dead_time_and_is_warned_of_in_flight(direction, age):
    summary = flown(None, "corners", direction=direction)
    told = summary.as_dict()["dead_time_s"]
    assert (told["roll"], told["pitch"]) == pytest.approx((0.08, 0.08), abs=0.004)
    assert told["sample_age_p50"] == pytest.approx(age, abs=0.005)
    (when,) = warnings(summary)
    assert when < next(time for time, text in summary.events if text == "mode AUTO.LAND")
