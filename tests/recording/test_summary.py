"""The measurements recover the response they are given, and the JSON has the promised keys."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

from companion.attitude import Coefficients, attitude
from companion.recording.measurements.dead_time import AxisDeadTime, DeadTimes, SampleAge
from companion.recording.measurements.response import measure_response
from companion.recording.measurements.second_order import step_runs
from companion.recording.measurements.summary import LoopCounts, Summary
from companion.recording.trace import FlightTrace

NORTH, EAST = (1.0, 0.0), (0.0, 1.0)


def trace_of(tau, bend=0.0, directions=(NORTH, EAST), wind=(0.0, 0.0), size=0.2, gust=0.0):
    """Doublets answered exactly with the time constant `tau`; `bend` moves across the step.

    `wind` are the coefficients at which the vehicle is at rest; a `gust` moves where it begins.
    """
    trace = FlightTrace()
    for number, direction in enumerate(directions):
        along = gust
        for k in range(800):
            target = size if k < 200 or k >= 600 else -size
            across = bend * math.sin(k / 100.0) + gust * math.cos(k / 100.0)
            north = wind[0] + along * direction[0] - across * direction[1]
            east = wind[1] + along * direction[1] + across * direction[0]
            q = attitude(Coefficients(north, east), 0.4)
            asked = wind[0] + target * direction[0], wind[1] + target * direction[1]
            trace.response.add([number * 10.0 + k * 0.005, *q, *asked])
            along = target + (along - target) * math.exp(-0.005 / tau)
    return trace


@pytest.mark.parametrize(
    "tau", [0.2, *(pytest.param(t, marks=pytest.mark.slow) for t in (0.1, 0.34))]
)
def test_time_constants_are_recovered(tau):
    response = measure_response(trace_of(tau).response.rows(), gain=1 / tau)
    assert response.time_constant_north_s == pytest.approx(tau, rel=1e-3)
    assert response.time_constant_east_s == pytest.approx(tau, rel=1e-3)
    assert response.cross_axis_max == pytest.approx(0.0, abs=1e-9)
    assert response.model_deviation_max == pytest.approx(0.0, abs=1e-9)


def test_deviation_and_cross_axis_are_seen():
    response = measure_response(trace_of(0.3, bend=0.02).response.rows(), gain=5.0)
    assert response.cross_axis_max == pytest.approx(0.02, rel=0.05)
    assert 0.03 < response.model_deviation_max < 0.1


@pytest.mark.parametrize("wind", [(0.0, 0.0), (-0.4, 0.02), (0.3, 0.3)])
def test_wind_changes_neither_the_size_of_the_steps_nor_the_axes_that_were_flown(wind):
    response = measure_response(trace_of(0.3, directions=[NORTH], wind=wind).response.rows(), 5.0)
    assert response.step_size == pytest.approx(0.2)
    assert response.time_constant_north_s == pytest.approx(0.3, rel=1e-3)
    assert math.isnan(response.time_constant_east_s)


@pytest.mark.parametrize(
    ("degrees", "words"),
    [
        *((0.7, "north"), (-0.7, "north"), (44.0, "north-east"), (91.0, "east")),
        *((135.0, "south-east"), (-179.0, "south"), (179.0, "south"), (-135.0, "south-west")),
        *((-90.7, "west"), (-67.0, "north-west"), (-68.0, "west")),
    ],
)
def test_a_doublet_is_named_by_the_nearest_point_of_the_compass(degrees, words):
    angle = math.radians(degrees)
    way, wind = (math.cos(angle), math.sin(angle)), (0.1, -0.3)
    (run,) = step_runs(trace_of(0.3, directions=[way], wind=wind).response.rows())
    assert run.compass_point == words
    assert run.direction == pytest.approx(way)


def trace_in_wind():
    """A doublet north of 0.25 from the attitude that balances a wind, which gusts a little."""
    return trace_of(0.3, directions=[NORTH], wind=(0.3, -0.3), size=0.25, gust=0.02)


def test_the_tilt_that_balances_the_wind_is_no_part_of_a_step():
    response = measure_response(trace_in_wind().response.rows(), gain=5.0)
    assert response.step_size == pytest.approx(0.25, abs=0.03)
    assert response.target_tilt == pytest.approx(math.asin(math.hypot(0.55, 0.3)))
    calm = measure_response(trace_of(0.3).response.rows(), gain=5.0)
    assert (calm.step_size, calm.target_tilt) == pytest.approx((0.2, math.asin(0.2)))


def test_an_axis_that_no_step_moved_has_no_time_constant():
    data = summary(trace_in_wind()).as_dict()["response"]
    assert data["time_constant_s"] == {"north": pytest.approx(0.3, abs=0.03), "east": None}
    assert data["asked_tilt_deg"] == pytest.approx(38.79, abs=0.01)


def test_speed_and_tilt_of_the_maneuvers_are_not_those_of_the_take_off():
    trace = FlightTrace()
    trace.add_motion(1.0, (1.0, 101.0, 2.0, 1.5, 9.0, math.nan))
    for vehicle_time, name in ((102.0, "hover"), (104.0, "steps"), (106.0, None)):
        trace.begin_maneuver(vehicle_time - 100.0, vehicle_time, name)
    trace.add_motion(3.0, (3.0, 103.0, 5.0, 0.2, 1.0, 0.1))
    trace.response.add([105.0, *attitude(Coefficients(math.sin(0.2), 0.0), 0.0), 0.2, 0.0])
    trace.add_motion(7.0, (7.0, 107.0, 4.0, 1.2, 8.0, math.nan))
    extent = summary(trace).extent()
    assert (extent["speed_max_m_s"], extent["tilt_max_deg"]) == (
        1.5,
        pytest.approx(11.459, abs=1e-3),
    )
    assert extent["maneuver_speed_max_m_s"] == 0.2
    assert extent["maneuver_tilt_max_deg"] == pytest.approx(math.degrees(0.2))
    never = summary(FlightTrace()).as_dict()["extent"]
    assert (never["maneuver_speed_max_m_s"], never["maneuver_tilt_max_deg"]) == (None, None)


def test_without_steps_there_is_no_response():
    assert measure_response(FlightTrace().response.rows(), 5.0) is None


def summary(trace, dead_times=DeadTimes()):  # noqa: B008
    counts = LoopCounts(7, 6, 1)
    return Summary(
        "ok", "disarm", "exact", 5.0, counts, {"lost": 0}, trace, [], Path("x"), dead_times
    )


def test_json_has_the_promised_keys():
    trace = trace_of(0.2)
    trace.latencies_ns.add([40_000])
    trace.tracking.add([0.0, 0.0, 0.0, -5.0, 0.3, 0.4, -5.1])
    trace.tracking.add([0.1, math.nan, math.nan, -5.0, 9.0, 9.0, -4.9])
    trace.tracking.add([0.2, 0.0, 0.0, math.nan, 9.0, 9.0, -9.0])  # a program's own thrust
    dead_times = DeadTimes(
        {"roll": AxisDeadTime(0.042, 0.04), "pitch": AxisDeadTime(), "yaw": AxisDeadTime()},
        SampleAge(0.002, 0.004),
    )
    data = json.loads(summary(trace, dead_times).as_json())
    assert data["result"] == "ok"
    assert data["phase"] == "disarm"
    assert (data["samples"], data["setpoints"], data["missed_deadlines"]) == (7, 6, 1)
    assert data["latency_us"] == {"p50": 40.0, "p99": 40.0, "max": 40.0}
    assert set(data["response"]["time_constant_s"]) == {"north", "east"}
    assert {"cross_axis_max", "model_deviation_max"} <= set(data["response"])
    model = data["response"]["second_order"]
    assert set(model) == {"frequency_rad_s", "damping", "dead_time_s", "deviation_max"}
    assert model["deviation_max"] < 0.05
    assert model["frequency_rad_s"] > 5.0
    assert data["dead_time_s"] == {
        "roll": 0.042,
        "pitch": None,
        "yaw": None,
        "sample_age_p50": 0.002,
        "sample_age_p99": 0.004,
    }
    assert data["tracking"]["position_rms_m"] == pytest.approx(np.sqrt(0.26))
    assert data["tracking"]["height_rms_m"] == pytest.approx(0.1)
    assert data["log"] == "x"


def test_json_of_a_flight_that_measured_nothing_is_null_not_nan():
    data = json.loads(summary(FlightTrace()).as_json())
    assert data["latency_us"]["p50"] is None
    assert data["response"]["cross_axis_max"] is None
    assert set(data["response"]["second_order"].values()) == {None}
    assert set(data["dead_time_s"].values()) == {None}
    assert data["tracking"]["position_max_m"] is None


def test_every_key_is_explained_in_the_documentation():
    page = (Path(__file__).parents[2] / "docs/recordings.md").read_text("utf-8")
    for key in summary(FlightTrace()).as_dict():
        assert f"`{key}`" in page, key
