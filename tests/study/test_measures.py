"""The measures of the studies on responses whose numbers are known by construction."""

import numpy as np
import pytest

from companion.attitude import Coefficients
from companion.recording.measurements.second_order import SecondOrderModel
from companion.study.measures import (
    cross_track,
    fit_second_order,
    heading_effect,
    largest_deviation,
    largest_tilt_rate,
    second_order_path,
    settling_time,
)
from companion.study.methods import EXACT, LAW_METHODS, planner_of
from companion.study.step import Response, Step, fly

STEP = Step(Coefficients(0.0, 0.0), Coefficients(0.3, 0.4), rate_hz=100.0, headings=(0.0, 1.0))


def response(*paths):
    c = np.stack(paths, axis=-1)
    return Response(STEP, c, np.zeros((STEP.samples, 3, len(paths))))


def along(share, across=0.0):
    """(samples + 1, 2) at a share of the way, and beside it."""
    share = np.broadcast_to(share, STEP.time.shape)
    return share[:, None] * np.array([0.3, 0.4]) + across * np.array([-0.8, 0.6])


def test_cross_track_is_the_distance_from_the_line_whatever_the_progress():
    progress = 1.0 - np.exp(-STEP.time)
    assert cross_track(response(along(progress), along(progress, 0.02))) == pytest.approx(
        [0.0, 0.02], abs=1e-15
    )


def test_deviation_is_the_largest_distance_from_the_reference():
    reference = along(0.5)
    away = largest_deviation(response(along(0.5), along(0.7)), reference)
    assert away == pytest.approx([0.0, 0.1])


def test_time_to_is_when_the_rest_stays_small():
    leaving = np.where((STEP.time > 0.5) & ((STEP.time < 0.9) | (STEP.time > 0.995)), 0.97, 0.5)
    steady = np.where(STEP.time > 0.295, 1.0, 0.0)
    assert settling_time(response(along(leaving), along(steady))) == pytest.approx([1.0, 0.3])
    assert settling_time(response(along(0.9), along(1.0))) == pytest.approx([np.inf, 0.0])


def test_the_effect_of_heading_is_the_largest_difference_between_paths():
    assert heading_effect(response(along(0.5), along(0.5))) == 0.0
    assert heading_effect(response(along(0.5), along(0.6))) == pytest.approx(0.04)


def test_the_tilt_rate_leaves_yaw_out():
    flown = response(along(0.0), along(1.0))
    flown.rates[3, :, 1] = 3.0, -4.0, 100.0
    assert largest_tilt_rate(flown) == 5.0


def test_a_second_order_response_is_found_again():
    path = second_order_path(STEP, SecondOrderModel(9.0, 0.7, 0.043), STEP.time)
    assert path[4] == pytest.approx(STEP.start)  # still dead at 40 ms
    found = fit_second_order(STEP, path)
    assert found.dead_time == pytest.approx(0.043, rel=1e-3)
    assert found.frequency == pytest.approx(9.0, rel=1e-3)
    assert found.damping == pytest.approx(0.7, rel=1e-3)


def test_a_flown_response_begins_at_the_start_and_ends_at_the_target():
    for method in LAW_METHODS:
        flown = fly(planner_of(method, STEP.gain), STEP)
        assert flown.coefficients.shape == (201, 2, 2)
        assert flown.at_heading(1)[0] == pytest.approx(STEP.start, abs=1e-12)
        assert flown.at_heading(1)[-1] == pytest.approx(STEP.target, abs=1e-3)


def test_exact_follows_the_reference_of_the_step():
    flown = fly(planner_of(EXACT, STEP.gain), STEP)
    assert largest_deviation(flown, STEP.reference()).max() < 1e-12
