"""Maneuvers: their derivatives against finite differences, their beginnings and ends."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from companion.guidance import Corners, ManeuverSequence, Pose, Steps
from companion.guidance.follow import circle, hover
from companion.guidance.reference import HorizontalMode

START = Pose((3.0, -2.0, -5.0), 0.7)
CIRCLES = [(3.0, 2.0, 1.0), (1.0, 3.0, 0.2), (8.0, 0.5, 2.5)]
"""Radius in m, speed in m/s, laps."""


@pytest.mark.parametrize("flown", CIRCLES)
def test_circle_derivatives_agree_with_finite_differences(flown):
    lap, h = circle(*flown), 1e-4
    for t in np.linspace(2 * h, lap.duration - 2 * h, 200):
        behind, here, ahead = (lap.at(t + d, START) for d in (-h, 0.0, h))
        velocity = (np.array(ahead.position_ned) - np.array(behind.position_ned)) / (2 * h)
        acceleration = (np.array(ahead.velocity_ned) - np.array(behind.velocity_ned)) / (2 * h)
        assert here.velocity_ned == pytest.approx(velocity, abs=1e-6)
        # The raised cosine has a kink in its acceleration where a ramp begins or ends.
        assert here.acceleration_ned == pytest.approx(acceleration, abs=2e-3)


@pytest.mark.parametrize(("radius", "speed", "laps"), CIRCLES)
def test_circle_begins_and_ends_at_rest_and_keeps_its_radius(radius, speed, laps):
    flown = circle(radius, speed, laps)
    for t in (0.0, flown.duration, flown.duration + 5.0):
        assert flown.at(t, START).velocity_ned == pytest.approx((0, 0, 0), abs=1e-9)
    assert flown.at(0.0, START).position_ned == pytest.approx(START.position_ned)
    centre = np.add(START.position_ned, (radius, 0.0, 0.0))
    for t in np.linspace(0.0, flown.duration, 50):
        reference = flown.at(t, START)
        assert np.linalg.norm(np.array(reference.position_ned) - centre) == pytest.approx(radius)
        assert np.linalg.norm(reference.velocity_ned) <= speed * (1 + 1e-9)
        assert reference.heading == START.heading
    full = laps % 1.0 == 0.0
    end = flown.at(flown.duration, START).position_ned
    assert (end == pytest.approx(START.position_ned, abs=1e-9)) is full


def test_steps_leave_an_ideal_vehicle_where_it_was():
    steps = Steps(0.25, 1.0, 3.0)
    h = 1e-3
    velocity, position = np.zeros(2), np.zeros(2)
    largest = 0.0
    for k in range(round(steps.duration / h)):
        c = steps.at((k + 0.5) * h, START).coefficients
        velocity += 9.8 * np.array(c or (0.0, 0.0)) * h
        position += velocity * h
        if c:
            assert np.hypot(*c) == pytest.approx(0.25)
            largest = max(largest, np.hypot(*position))
    assert velocity == pytest.approx([0.0, 0.0], abs=1e-9)
    assert position == pytest.approx([0.0, 0.0], abs=1e-6)
    assert 2.0 < largest < 3.0
    assert steps.at(steps.duration + 1.0, START).coefficients is None


@pytest.mark.parametrize("maneuvers", [Steps(0.25, 1.0, 3.0), Corners(0.3, 0.4, 1.0, 2.0)])
def test_the_hold_pauses_before_a_run_of_steps_and_nowhere_else(maneuvers):
    paused, before = 0.0, hover(1.0).at(0.0, START)
    for k in range(round(maneuvers.duration / 0.01)):
        reference = maneuvers.at(0.01 * k + 0.005, START)
        paused += 0.01 * (reference.horizontal is HorizontalMode.ACCELERATION)
        if reference.coefficients and not before.coefficients:
            assert before.horizontal is HorizontalMode.ACCELERATION
        before = reference
    runs = 3 if isinstance(maneuvers, Steps) else 1
    assert paused == pytest.approx(runs * 1.0)


@pytest.mark.parametrize("maneuvers", [Steps(0.25, 0.7, 3.0), Corners(0.3, 0.4, 0.7, 2.0)])
def test_steps_are_added_to_the_tilt_that_holds_against_the_wind(maneuvers):
    times = np.arange(0.005, maneuvers.duration, 0.01)
    steps = [r for t in times if (r := maneuvers.at(float(t), START)).coefficients]
    assert steps
    assert all(step.horizontal.trimmed is True for step in steps)


def test_each_corner_is_held_for_its_time():
    """Two rounds, the second one mirrored, as by hand."""
    corners = Corners(0.3, 0.4, 0.7, 2.0)
    signs = [(1, 1), (-1, 1), (-1, -1), (1, -1), (1, -1), (-1, -1), (-1, 1), (1, 1)]
    for index, (north, east) in enumerate(signs):
        for share in (0.01, 0.99):
            asked = corners.at(1.0 + 0.7 * (index + share), START).coefficients
            assert asked == pytest.approx((0.3 * north, 0.4 * east))
    assert corners.at(1.0 + 0.7 * 8.01, START).coefficients is None
    times = np.array(corners.check_times())
    assert times[0] == pytest.approx(1.0)
    assert times[-2] == pytest.approx(1.0 + 0.7 * 8)
    assert np.diff(times[:-1]).max() < 0.0101


def test_the_times_to_check_of_steps_cover_each_doublet_and_nothing_else():
    steps = Steps(0.25, 0.7, 3.0)
    times = np.array(steps.check_times())
    begins = np.array([1.0, 7.8, 14.6])  # a pause of 1 s, doublets of 2.8 s, settling of 3 s
    inside = [(begin - 1e-9 <= times) & (times <= begin + 2.8 + 1e-9) for begin in begins]
    assert np.any(inside, axis=0).all()
    for one in inside:
        assert times[one][[0, -1]] == pytest.approx(times[one][0] + np.array([0.0, 2.8]))
        assert np.diff(times[one]).max() < 0.0101


def test_the_circle_gathers_speed_as_a_raised_cosine_and_no_lap_is_too_long_to_check():
    """Half the speed in the middle of a ramp of speed/(1 m/s²), three quarters after two thirds."""
    flown = circle(3.0, 2.0, 1.0)
    for time, speed in ((1.0, 1.0), (4.0 / 3.0, 1.5), (2.0, 2.0), (flown.duration - 1.0, 1.0)):
        assert np.linalg.norm(flown.at(time, START).velocity_ned) == pytest.approx(speed)
    assert flown.duration == pytest.approx(2.0 * np.pi * 3.0 / 2.0 + 2.0)
    hours = circle(3.0, 2.0, 1000.0)
    assert hours.duration > 9000.0
    assert hours.check_times()[-1] == hours.duration


@given(st.floats(0.0, 40.0))
def test_sequence_plays_its_parts_in_order(time):
    parts = [hover(3.0), Steps(0.2, 1.0, 2.0), circle(3.0, 2.0, 1.0)]
    sequence = ManeuverSequence(parts)
    assert sequence.duration == pytest.approx(sum(p.duration for p in parts))
    edges = np.cumsum([p.duration for p in parts])
    expected = min(int(np.searchsorted(edges, time, side="right")), 2)
    part, within = sequence.maneuver_at(time)
    assert part is parts[expected]
    assert within == pytest.approx(time - (edges[expected - 1] if expected else 0.0))
    assert sequence.at(time, START) == part.at(within, START)
    assert sequence.name == "hover, steps, circle"


def test_corners_bring_an_ideal_vehicle_back_and_never_step_through_level():
    corners = Corners(0.3, 0.4, 1.0, 2.0)
    dt = 1e-3
    times = np.arange(0.0, corners.duration, dt) + 0.5 * dt
    asked = [corners.at(float(t), START).coefficients for t in times]
    assert asked[-1] is None
    c = np.array([a for a in asked if a is not None])
    velocity = np.cumsum(c, axis=0) * dt
    assert velocity[-1] == pytest.approx([0.0, 0.0], abs=1e-9)
    assert np.sum(velocity, axis=0) * dt == pytest.approx([0.0, 0.0], abs=1e-2)
    steps = np.diff(c, axis=0)
    for k in np.flatnonzero(np.any(steps, axis=1)):
        middle = 0.5 * (c[k] + c[k + 1])
        assert np.abs(middle).max() >= 0.3 - 1e-9  # half way it is not level
