"""Maneuver `identify`: what it asks for comes back to where it began, and stays small."""

from itertools import pairwise

import numpy as np
import pytest

from companion.guidance import Doublets, Pose

START = Pose((3.0, -2.0, -5.0), 0.7)
DOUBLETS = Doublets(
    tilt_rate=1.0,
    tilt_step_time=0.25,
    yaw_rate=0.8,
    yaw_step_time=1.2,
    climb_acceleration=2.0,
    climb_step_time=0.3,
    settle_time=1.5,
)
STEP = 1e-3
TIMES = np.arange(0.0, DOUBLETS.duration, STEP)


@pytest.fixture(scope="module")
def references():
    return [DOUBLETS.at(float(time), START) for time in TIMES]


@pytest.fixture(scope="module")
def rates(references):
    """(n, 3), rad/s, NaN where position is held."""
    return np.array([r.body_rates or 3 * (np.nan,) for r in references])


def open_loop_parts(rates):
    """Index ranges of the stretches flown by rates."""
    inside = np.flatnonzero(~np.isnan(rates[:, 0]))
    return np.split(inside, np.flatnonzero(np.diff(inside) > 1) + 1)


def test_each_axis_is_excited_alone_in_half_and_in_full_size(rates):
    found = []
    for part in open_loop_parts(rates):
        largest = np.abs(rates[part]).max(axis=0)
        assert np.count_nonzero(largest) == 1
        axis = int(np.argmax(largest))
        found.append((axis, largest[axis]))
    assert found == [(0, 0.5), (0, 1.0), (1, 0.5), (1, 1.0), (2, 0.4), (2, 0.8)]


def test_each_doublet_turns_back_and_ends_with_a_rest(rates):
    for part in open_loop_parts(rates):
        angle = np.cumsum(rates[part].sum(axis=1)) * STEP
        yaws = rates[part][:, 2].any()
        size, step = np.abs(rates[part]).max(), 1.2 if yaws else 0.25
        assert angle.max() == pytest.approx(size * step, abs=5e-3)
        assert angle.min() == pytest.approx(-size * step, abs=5e-3)
        assert angle[-1] == pytest.approx(0.0, abs=5e-3)
        at_rest = rates[part][round(4 * step / STEP) + 1 :]
        assert at_rest.shape[0] == pytest.approx(500, abs=2)
        assert not at_rest.any()


def test_each_part_of_a_doublet_begins_at_its_first_moment():
    """+A, −A, +A, rest, after 1.5 s of hold; T is 0.25 s: exact in binary."""
    rolls = [DOUBLETS.at(1.5 + time, START).body_rates.roll for time in (0.0, 0.25, 0.75, 1.0)]
    assert rolls == [0.5, -0.5, 0.5, 0.0]


def test_the_times_to_check_cover_each_doublet_with_its_rest_and_the_end():
    times = np.array(DOUBLETS.check_times())
    assert times[[0, -1]].tolist() == [0.0, DOUBLETS.duration]
    begin, covered = 0.0, np.zeros(times.size - 2, bool)
    for duration in (1.5, 1.5, 1.5, 1.5, 5.3, 5.3, 1.2, 1.2, 1.2):  # by hand
        begin += 1.5
        inside = (times[1:-1] >= begin - 1e-9) & (times[1:-1] <= begin + duration + 1e-9)
        assert times[1:-1][inside][[0, -1]] == pytest.approx((begin, begin + duration))
        assert np.diff(times[1:-1][inside]).max() < 0.0101
        begin, covered = begin + duration, covered | inside
    assert covered.all()


def test_position_is_held_before_each_doublet_and_at_the_end(rates, references):
    parts = open_loop_parts(rates)
    assert TIMES[parts[0][0]] == pytest.approx(DOUBLETS.settle_time, abs=2 * STEP)
    for before, after in pairwise(parts):
        assert TIMES[after[0]] - TIMES[before[-1]] == pytest.approx(1.5, abs=2 * STEP)
    last = [r.acceleration_ned[2] != 0.0 for r in references]
    assert TIMES[-1] - TIMES[np.flatnonzero(last)[-1]] == pytest.approx(1.5, abs=2 * STEP)
    held = DOUBLETS.at(DOUBLETS.duration + 5.0, START)
    assert (held.position_ned, held.heading) == (START.position_ned, START.heading)
    assert held.closed_loop
    assert held.thrust_is_steady


def test_climbs_are_one_motion_and_come_back(references):
    motions = [(r.position_ned, r.velocity_ned, r.acceleration_ned) for r in references]
    down = np.array(motions)[:, :, 2]
    climbs = np.flatnonzero(down[:, 2])
    assert np.diff(down[:, 0])[climbs[:-1]] / STEP == pytest.approx(down[climbs[:-1], 1], abs=3e-3)
    assert np.sum(down[:, 2]) * STEP == pytest.approx(0.0, abs=1e-2)
    assert set(down[climbs, 2]) == {-2.0, 2.0}
    assert down[climbs, 2][0] == -2.0  # upwards first
    assert down[:, 0].min() - START.position_ned[2] == pytest.approx(-2.0 * 0.3**2, abs=2e-3)
    assert down[:, 0].max() == pytest.approx(START.position_ned[2], abs=2e-3)
    assert down[-1] == pytest.approx([START.position_ned[2], 0.0, 0.0])


def test_the_hover_thrust_is_learned_only_where_the_height_is_steady(references):
    for reference in references:
        moving = reference.body_rates is not None or reference.acceleration_ned[2] != 0.0
        assert reference.thrust_is_steady is not moving
        assert reference.closed_loop is (reference.body_rates is None)
