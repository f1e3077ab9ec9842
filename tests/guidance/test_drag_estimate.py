"""The learned drag, on a vehicle that circles in wind; and the formula of drag itself."""

import numpy as np
import pytest

from companion.drag import AxisDrag, Drag
from companion.guidance.drag_estimate import ANY_VEHICLE, DragEstimate, DragPrior

DT = 0.02
RADIUS, HEADING = 5.0, 0.3
TRUE = {"px4": Drag(1.0), "ardupilot": Drag(0.25, 0.033), "light": Drag(0.2)}


def told(drag):
    return DragPrior(drag, 0.2, 0.02)


def circled(
    estimate, true, seconds, speed=5.0, wind=(0.0, 0.0), gust=0.0, noise=0.02, seed=2, bluff=0.0
):
    """The estimate after 2 s of hover and `seconds` from rest on a circle, step by step.

    The measured velocity has noise, and gusts have the mock's time constant of 2 s.
    """
    rng, blown, drags = np.random.default_rng(seed), np.zeros(2), []
    before, angle = None, 0.0
    for n in range(round((2.0 + seconds) / DT)):
        fast = min(speed, 2.0 * max(0.0, n * DT - 2.0))
        angle += DT * fast / RADIUS
        v = fast * np.array([np.cos(angle), np.sin(angle), 0.0])
        fade = np.exp(-DT / 2.0)
        blown = fade * blown + gust * np.sqrt(1.0 - fade**2) * rng.normal(size=2)
        air = v - [*(np.array(wind) + blown), 0.0]
        measured = v + noise * rng.normal(size=3)
        if before is not None:
            change, thrust = (measured - before[0]) / DT, (v - before[1]) / DT
            left = change[:2] - thrust[:2] - true.deceleration(tuple(air))[:2]
            left -= bluff_deceleration(bluff, air[:2])
            estimate.observe(DT, tuple(0.5 * (measured + before[0])), tuple(left), HEADING)
            drags.append(estimate.drag)
        before = measured, v
    return drags


def bluff_deceleration(coefficient, air):
    """Quadratic drag along the axes of a vehicle at `HEADING`."""
    axes = np.array([[np.cos(HEADING), np.sin(HEADING)], [-np.sin(HEADING), np.cos(HEADING)]])
    along = axes @ air
    return axes.T @ (coefficient * np.abs(along) * along)


@pytest.mark.parametrize("vehicle", TRUE)
def test_three_seconds_from_rest_tell_the_drag_of_a_vehicle_that_nobody_knows(vehicle):
    estimate = DragEstimate(ANY_VEHICLE)
    circled(estimate, TRUE[vehicle], 3.0)
    assert estimate.certain
    expected = TRUE[vehicle].per_velocity(5.0)
    assert estimate.drag.per_velocity(5.0) == pytest.approx(expected, abs=0.04)


@pytest.mark.parametrize("seed", range(5))
def test_in_wind_and_gusts_it_takes_ten(seed):
    estimate = DragEstimate(ANY_VEHICLE)
    circled(estimate, Drag(0.5), 10.0, wind=(2.0, -1.0), gust=1.0, seed=seed)
    assert estimate.drag.per_velocity(5.0) == pytest.approx(0.5, abs=0.08)


@pytest.mark.parametrize(("gust", "certain"), [(0.0, True), (0.5, True), (2.5, False)])
def test_in_strong_gusts_the_drag_is_not_certain(gust, certain):
    """There it would be advised, and kept for the next flight, though it is wrong by half."""
    estimate = DragEstimate(ANY_VEHICLE)
    circled(estimate, Drag(1.0), 20.0, speed=2.0, wind=(3.0, 0.0), gust=gust)
    assert estimate.certain == certain


def test_two_speeds_tell_quadratic_drag_from_linear():
    estimate = DragEstimate(ANY_VEHICLE)
    for speed in (2.0, 5.0, 8.0):
        circled(estimate, TRUE["ardupilot"], 20.0, speed)
    assert estimate.drag.linear == pytest.approx(0.25, abs=0.04)
    assert estimate.drag.quadratic == pytest.approx(0.033, abs=0.006)


def test_it_keeps_what_it_knows_through_minutes_of_hover():
    estimate = DragEstimate(ANY_VEHICLE)
    circled(estimate, Drag(1.0), 5.0, wind=(3.0, 0.0))
    known = estimate.drag.per_velocity(5.0)
    drags = circled(estimate, Drag(1.0), 120.0, speed=0.0, wind=(3.0, 0.0), gust=1.0)
    assert drags[-1].per_velocity(5.0) == pytest.approx(known, abs=0.06)


def test_a_hover_in_wind_teaches_nothing():
    estimate = DragEstimate(told(Drag(0.5)))
    circled(estimate, Drag(1.0), 60.0, speed=0.0, wind=(4.0, 1.0))
    assert estimate.drag.linear == pytest.approx(0.5, abs=0.01)
    assert not estimate.certain


@pytest.mark.parametrize("configured", [0.0, 0.5, 1.5, 3.0])
def test_what_is_told_wrong_is_put_right(configured):
    estimate = DragEstimate(told(Drag(configured)))
    assert estimate.drag == Drag(configured)
    circled(estimate, Drag(1.0), 20.0)
    assert estimate.drag.per_velocity(5.0) == pytest.approx(1.0, abs=0.06)


def test_a_large_quadratic_drag_that_was_told_is_not_cut():
    drags = circled(DragEstimate(told(Drag(0.2, 0.8))), Drag(0.2, 0.8), 2.0, speed=3.0)
    assert all(drag.per_velocity(3.0) == pytest.approx(2.6, abs=0.2) for drag in drags)


def test_it_is_never_negative_nor_beyond_belief():
    pushed = circled(DragEstimate(ANY_VEHICLE), Drag(-2.0), 20.0)
    assert all(drag.linear >= 0.0 and drag.quadratic >= 0.0 for drag in pushed)
    assert pushed[-1] == Drag(0.0, 0.0)
    for drag in circled(DragEstimate(ANY_VEHICLE), Drag(50.0, 3.0), 20.0):
        assert drag.linear <= 2.3
        assert drag.quadratic <= 0.3


def test_bad_data_and_bumps_hardly_move_it():
    estimate = DragEstimate(ANY_VEHICLE)
    circled(estimate, Drag(0.5), 10.0)
    known, inf, nan = estimate.drag, np.inf, np.nan
    for bad in (nan, inf, -inf):
        estimate.observe(DT, (bad, 0.0, 0.0), (0.0, 0.0))
        estimate.observe(DT, (1.0, 0.0, 0.0), (0.0, bad))
        estimate.observe(bad, (1.0, 0.0, 0.0), (0.0, 0.0))
    estimate.observe(0.0, (1.0, 0.0, 0.0), (9.0, 9.0))
    assert estimate.drag == known
    for _ in range(10):  # an estimate that jumps by 20 m/s
        estimate.observe(DT, (5.0, 0.0, 0.0), (100.0, -100.0))
    assert estimate.drag.per_velocity(5.0) == pytest.approx(known.per_velocity(5.0), abs=0.05)


@pytest.mark.parametrize("drag", [Drag(0.7), Drag(0.25, 0.033), Drag(0.0, 0.1)])
def test_the_deceleration_rate_is_the_derivative_of_the_deceleration(drag):
    velocity, acceleration, h = np.array([3.0, -2.0, 1.0]), np.array([-1.0, 4.0, 0.5]), 1e-6
    ahead, behind = (drag.deceleration(tuple(velocity + k * h * acceleration)) for k in (1, -1))
    expected = (np.array(ahead) - behind) / (2.0 * h)
    assert drag.deceleration_rate(tuple(velocity), tuple(acceleration)) == pytest.approx(
        expected, abs=1e-7
    )
    at_rest = drag.deceleration_rate((0.0, 0.0, 0.0), tuple(acceleration))
    assert at_rest == pytest.approx(drag.linear * acceleration, abs=1e-5)
    speed = np.linalg.norm(velocity)
    assert np.linalg.norm(drag.deceleration(tuple(velocity))) == pytest.approx(
        drag.per_velocity(speed) * speed
    )


def test_half_a_lap_shows_drag_along_the_axes_of_the_body():
    """ArduPilot's simulator: 0.034 1/m along each axis. A round body has none."""
    for bluff in (0.034, 0.0):
        estimate = DragEstimate(ANY_VEHICLE)
        circled(estimate, Drag(0.27), 6.0, bluff=bluff)
        assert estimate.axis_coefficient == pytest.approx(bluff, abs=0.006)


def test_axis_drag_and_its_mean_are_quadratic_drag_along_the_axes():
    """Its mean over all directions is 0; with 8/3π of quadratic drag it acts along the axes."""
    axis_drag, mean = AxisDrag(0.04, HEADING), Drag(0.0, 0.04 * 8.0 / (3.0 * np.pi))
    along = []
    for angle in np.linspace(0.0, 2.0 * np.pi, 60, endpoint=False):
        velocity = 7.0 * np.array([np.cos(angle), np.sin(angle)])
        more = np.array(axis_drag.deceleration(*velocity))
        told = mean.deceleration((*velocity, 0.0))[:2] + more
        assert told == pytest.approx(bluff_deceleration(0.04, velocity), abs=1e-9)
        along.append(more @ velocity)
    assert np.mean(along) == pytest.approx(0.0, abs=0.03)
