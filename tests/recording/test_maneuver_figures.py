"""Each maneuver has its own figures, by the rows that were recorded while it was flown."""

from math import nan

import numpy as np
import pytest

from companion.recording.measurements.maneuver_figures import SETTLING_TIME, measure_maneuvers
from companion.recording.trace import ManeuverChange

RATE = 50


def rows(begin, seconds, reference, position):
    """Rows from vehicle time `begin` on; `reference` and `position` are functions of time (s)."""
    times = [k / RATE for k in range(round(seconds * RATE))]
    return [[begin + time, *reference(time), *position(time)] for time in times]


def hover(off):
    return lambda _: (0.0, 0.0, -5.0), lambda time: (off(time), 0.0, -5.1)


HOVER = rows(100.0, 10.0, *hover(lambda time: 1.0 if time < SETTLING_TIME else 0.03))
STEPS = rows(
    110.0,
    8.0,
    lambda time: (nan, nan, -5.0) if 1.0 < time < 5.0 else (0.0, 0.0, -5.0),
    lambda time: (0.3 * time, 0.4 * time, -5.0),
)
LINE = rows(118.0, 10.0, lambda time: (2.0 * time, 0.0, -5.0), lambda time: (2.0 * time, 0.2, -4.8))
ALL = np.array(HOVER + STEPS + LINE)
TIMES = np.arange(100.0, 128.0, 0.004)
RATES = np.column_stack([TIMES, 0.6 * np.sin(6.28 * TIMES), 0.8 * np.cos(6.28 * TIMES)])
MANEUVER_CHANGES = [
    ManeuverChange(50.0, 100.0, "hover"),
    ManeuverChange(60.0, 110.0, "steps"),
    ManeuverChange(68.0, 118.0, "line"),
    ManeuverChange(78.0, 128.0, None),
]


def test_each_maneuver_is_measured_by_itself():
    hover, steps, line = measure_maneuvers(ALL, RATES, MANEUVER_CHANGES, start_time=40.0)
    assert [one.name for one in (hover, steps, line)] == ["hover", "steps", "line"]
    assert [one.begin for one in (hover, steps, line)] == [10.0, 20.0, 28.0]
    assert hover.duration == pytest.approx(10.0, abs=0.03)
    assert (line.horizontal_rms, line.horizontal_max) == pytest.approx((0.2, 0.2))
    assert (line.height_rms, line.speed) == pytest.approx((0.2, 2.0))
    assert line.height_mean == pytest.approx(-0.2)  # at -4.8 it is below -5.0


def test_the_swing_is_measured_but_in_open_loop():
    hover, steps, line = measure_maneuvers(ALL, RATES, MANEUVER_CHANGES, 0.0)
    swing = pytest.approx(np.degrees(1.0 / 6.28 / 2**0.5), rel=0.02)
    for closed in (hover, line):
        assert closed.as_dict()["swing_rms_deg"] == swing
        assert closed.swing.period == pytest.approx(1.0, abs=0.01)
    assert steps.as_dict()["swing_rms_deg"] is steps.as_dict()["swing_period_s"] is None


def test_the_beginning_is_left_out_and_told_apart():
    hover, *_ = measure_maneuvers(ALL, RATES, MANEUVER_CHANGES, 0.0)
    assert hover.settling_time == SETTLING_TIME
    assert (hover.horizontal_rms, hover.horizontal_max) == pytest.approx((0.03, 0.03))
    assert hover.settling_max == pytest.approx((1.0 + 0.1**2) ** 0.5)


def test_of_a_short_maneuver_a_quarter_is_left_out():
    (short,) = measure_maneuvers(ALL[: 4 * RATE + 1], RATES, MANEUVER_CHANGES[:1], 0.0)
    assert short.settling_time == pytest.approx(1.0)


def test_open_loop_has_no_level_error_but_a_drift_and_a_height():
    _, steps, _ = measure_maneuvers(ALL, RATES, MANEUVER_CHANGES, 0.0)
    assert steps.open_loop
    assert np.isnan([steps.horizontal_rms, steps.horizontal_max, steps.speed]).all()
    assert steps.drift == pytest.approx(0.5 * 7.98)
    assert steps.height_rms == 0.0
    told = steps.as_dict()
    assert (told["name"], told["level_rms_m"], told["open_loop"]) == ("steps", None, True)


def test_what_was_not_recorded_is_not_measured():
    assert measure_maneuvers(np.empty((0, 7)), RATES, [], 0.0) == ()
    assert measure_maneuvers(np.empty((0, 7)), RATES, MANEUVER_CHANGES, 0.0) == ()
    assert [one.name for one in measure_maneuvers(ALL[:RATE], RATES, MANEUVER_CHANGES, 0.0)] == [
        "hover"
    ]


def test_a_thrust_that_another_program_commands_has_no_height_error():
    thrust = np.array(rows(0.0, 4.0, lambda _: (nan, nan, nan), lambda _: (0.0, 0.0, -5.0)))
    (one,) = measure_maneuvers(thrust, RATES, [ManeuverChange(0.0, 0.0, "mine")], 0.0)
    assert np.isnan([one.height_rms, one.height_max, one.height_mean]).all()
    assert one.as_dict()["height_rms_m"] is None


def test_without_a_height_reference_the_beginning_has_no_distance_either():
    thrust = np.array(rows(0.0, 4.0, lambda _: (1.0, 0.0, nan), lambda _: (0.0, 0.0, -5.0)))
    (one,) = measure_maneuvers(thrust, RATES, [ManeuverChange(0.0, 0.0, "mine")], 0.0)
    assert one.horizontal_max == 1.0
    assert one.as_dict()["beginning_max_m"] is None
