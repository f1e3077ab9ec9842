"""Tables and motions that a program made, instead of a file."""

import numpy as np
import pytest

from companion.guidance.trajectory import (
    Envelope,
    Frame,
    Motion,
    SampleOptions,
    Table,
    TrajectoryError,
    from_samples,
    motion_violations,
)

TIMES = np.linspace(0.0, 10.0, 201)
SHARE = TIMES / 10.0
ALONG = 10.0 * SHARE**3 * (10.0 - 15.0 * SHARE + 6.0 * SHARE**2)
PLACES = np.column_stack((ALONG, 0.0 * ALONG, 0.0 * ALONG))
STILL = np.zeros_like(PLACES)
ENU, NED = SampleOptions(), SampleOptions(frame=Frame.NED)


def end_of(table, options=NED):
    path = from_samples(table, options)
    return path.at(path.duration).position


def test_arrays_and_lists_are_a_table():
    for table in (
        Table(TIMES, PLACES, (), None),
        Table(TIMES.tolist(), PLACES.tolist(), (), None),
        Table(TIMES, PLACES, (), None, "ned"),
    ):
        assert end_of(table) == pytest.approx((10.0, 0.0, 0.0), abs=1e-6)


def test_a_table_in_another_frame_than_the_options_say_is_refused():
    """It was flown as ENU, 90 degrees to the side."""
    with pytest.raises(TrajectoryError, match=r"frame ned, and the options say enu; .*Frame\.NED"):
        end_of(Table(TIMES, PLACES, (), None, "ned"), ENU)


@pytest.mark.parametrize(
    ("table", "words"),
    [
        (Table(TIMES + 5.0, PLACES, (), None), "increase from 0"),  # 12 000 km/s at its start
        (Table(TIMES[::-1], PLACES, (), None), "increase from 0"),
        (Table(np.round(TIMES), PLACES, (), None), "increase from 0"),
        (Table(TIMES[:3], PLACES[:3], (), None), "at least 4 samples, not 3"),
        (Table(TIMES[:0], PLACES[:0], (), None), "at least 4 samples, not 0"),
        (Table(TIMES[:50], PLACES, (), None), r"position must have the shape \(50, 3\)"),
        (Table(TIMES, PLACES[:, :2], (), None), r"position must have the shape \(201, 3\)"),
        (Table(TIMES, np.where(PLACES > 5.0, np.nan, PLACES), (), None), "position has a number"),
        (Table(TIMES, PLACES, (STILL[:, :2],), None), "velocity must have the shape"),
        (Table(TIMES, PLACES, (), TIMES[:5]), "yaw must have the shape"),
        (Table("abc", PLACES, (), None), "times must be an array of numbers"),
    ],
)
def test_tables_that_are_none_are_refused(table, words):
    with pytest.raises(TrajectoryError, match=words):
        end_of(table)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (SampleOptions(frame="ned"), r"must be a Frame, such as Frame\.NED"),
        (SampleOptions(cutoff=0.0), "must be positive"),
        (SampleOptions(cutoff=np.nan), "must be positive"),
        (SampleOptions(acceleration=np.nan), "must be positive"),
    ],
)
def test_options_out_of_range_are_refused(options, words):
    with pytest.raises(TrajectoryError, match=words):
        end_of(Table(TIMES, PLACES, (), None), options)


def test_a_motion_that_is_not_finite_or_too_short_breaks_no_limit_and_is_refused():
    turn, limits = np.zeros_like(TIMES), Envelope(max_tilt=0.5)
    assert motion_violations(Motion(TIMES, PLACES, STILL, STILL, STILL, turn), limits) == ()
    with pytest.raises(TrajectoryError, match="cannot be computed"):
        motion_violations(Motion(TIMES, PLACES, STILL, STILL * np.nan, STILL, turn), limits)
    with pytest.raises(TrajectoryError, match="cannot be computed"):
        motion_violations(Motion(TIMES, PLACES, STILL, STILL, STILL, turn * np.nan), limits)
    with pytest.raises(TrajectoryError, match="201 times has vectors of the shape"):
        motion_violations(
            Motion(TIMES, PLACES[:5], STILL[:5], STILL[:5], STILL[:5], turn[:5]), limits
        )
