"""Minimum snap: against the literature, a dense quadratic maneuver and its own optimality."""

import numpy as np
import pytest
from numpy.polynomial import Polynomial
from scipy.linalg import null_space

from companion.guidance.trajectory.minimum_snap import FixedStates, Observations, minimum_snap
from companion.guidance.trajectory.septic_spline import (
    COEFFICIENTS_FROM_ENDS,
    STATE_SIZE,
    SepticSpline,
    derivative_rows,
)


def test_rest_to_rest_is_the_septic_of_the_literature():
    states = np.zeros((2, STATE_SIZE, 1))
    states[1, 0] = 1.0
    spline = minimum_snap(
        np.array([0.0, 1.0]), FixedStates(states, np.ones((2, STATE_SIZE), dtype=bool))
    )
    septic = Polynomial([0, 0, 0, 0, 35, -84, 70, -20])
    for u in np.linspace(0.0, 1.0, 21):
        expected = [septic.deriv(k)(u) if k else septic(u) for k in range(STATE_SIZE)]
        assert spline.at(u)[0] == pytest.approx(expected, abs=1e-12)


def test_the_coefficients_of_a_piece_are_exact():
    ends = [derivative_rows(np.array([u]), k)[0] for u in (0.0, 1.0) for k in range(STATE_SIZE)]
    np.testing.assert_allclose(np.array(ends) @ COEFFICIENTS_FROM_ENDS, np.eye(8), atol=1e-12)
    assert (np.rint(6.0 * COEFFICIENTS_FROM_ENDS) / 6.0 == COEFFICIENTS_FROM_ENDS).all()


def _problem(seed, count=6):
    """Knots, and what is fixed: places at all, all at the ends, a velocity on the way."""
    rng = np.random.default_rng(seed)
    knots = np.cumsum(rng.uniform(0.3, 3.0, count))
    states = np.zeros((count, STATE_SIZE, 3))
    states[:] = rng.normal(size=states.shape)
    mask = np.zeros((count, STATE_SIZE), dtype=bool)
    mask[:, 0] = True
    mask[[0, -1]] = True
    mask[2, 1] = True
    return knots, FixedStates(states, mask)


def _dense(knots, fixed, axis):
    """Coefficients (k−1, 8) over the fraction of each piece, by elimination of the constraints.

    Written over coefficients, with Gauss quadrature: nothing is shared with the solver.
    """
    spans, count = np.diff(knots), knots.size - 1
    nodes, weights = np.polynomial.legendre.leggauss(8)
    u = 0.5 * (nodes + 1.0)
    snap = np.array(
        [[k * (k - 1) * (k - 2) * (k - 3) * x ** max(k - 4, 0) for k in range(8)] for x in u]
    )
    cost = np.zeros((8 * count, 8 * count))
    rows, values = [], []

    def row(piece, place, order):
        out = np.zeros(8 * count)
        basis = [
            Polynomial.basis(k).deriv(order) if order else Polynomial.basis(k) for k in range(8)
        ]
        out[8 * piece : 8 * piece + 8] = [b(place) / spans[piece] ** order for b in basis]
        return out

    for i, span in enumerate(spans):
        cost[8 * i : 8 * i + 8, 8 * i : 8 * i + 8] = (snap.T * 0.5 * weights) @ snap / span**7
        for end, knot in ((0.0, i), (1.0, i + 1)):
            for order in np.flatnonzero(fixed.mask[knot]):
                rows.append(row(i, end, order))
                values.append(fixed.states[knot, order, axis])
    for i in range(count - 1):
        for order in range(1, STATE_SIZE):
            rows.append(row(i, 1.0, order) - row(i + 1, 0.0, order))
            values.append(0.0)
    a, b = np.array(rows), np.array(values)
    particular = np.linalg.lstsq(a, b, rcond=None)[0]
    free = null_space(a)
    step = np.linalg.lstsq(free.T @ cost @ free, -free.T @ cost @ particular, rcond=None)[0]
    return (particular + free @ step).reshape(count, 8)


@pytest.mark.parametrize("seed", range(5))
def test_it_is_the_optimum_of_the_dense_maneuver(seed):
    knots, fixed = _problem(seed)
    spline = minimum_snap(knots, fixed)
    for axis in range(3):
        pieces = _dense(knots, fixed, axis)
        for i, piece in enumerate(pieces):
            for u in (0.1, 0.5, 0.9):
                time = knots[i] + u * (knots[i + 1] - knots[i])
                assert spline.at(time)[axis][0] == pytest.approx(Polynomial(piece)(u), abs=1e-6)


def test_many_waypoints_are_met_and_derivatives_up_to_the_sixth_are_continuous():
    """What makes it optimal, and what a long chain of eliminations could lose."""
    knots, fixed = _problem(7, count=400)
    fixed.mask[2, 1] = False
    spline = minimum_snap(knots, fixed)
    h = 1e-3
    for knot, state in zip(knots[1:-1], fixed.states[1:-1], strict=True):
        jerks = []
        for side in (-1, 1):
            series = [spline.at(knot + side * k * h) for k in range(1, 6)]
            # Extrapolated to the knot from one side: value and slopes of the jerk.
            line = [np.polyfit(range(1, 6), [s[axis][3] for s in series], 4) for axis in range(3)]
            jerks.append([[p[-1], side * p[-2] / h, 2.0 * p[-3] / h**2] for p in line])
        before, after = np.array(jerks)
        np.testing.assert_allclose(before, after, atol=1e-3 * (1.0 + np.abs(before).max()))
        assert [axis[0] for axis in spline.at(knot)] == pytest.approx(state[0], abs=1e-9)


def test_observations_are_met_where_nothing_is_stiff_and_smoothed_where_it_is():
    times = np.linspace(0.0, 4.0, 41)
    knots = np.linspace(0.0, 4.0, 9)
    nothing = FixedStates(np.zeros((9, STATE_SIZE, 1)), np.zeros((9, STATE_SIZE), dtype=bool))
    smooth, rough = np.sin(times), 0.1 * (-1.0) ** np.arange(41)
    seen = Observations(times, (smooth + rough)[:, None], np.ones(41))
    spline = minimum_snap(knots, nothing, (seen,), stiffness=1e-3)
    inner = slice(4, -4)
    found = np.array([spline.at(t)[0][0] for t in times])
    assert np.abs(found - smooth)[inner].max() < 0.01
    exact = Observations(times, np.polyval([1.0, -2.0, 0.5, 3.0], times)[:, None], np.ones(41))
    cubic = minimum_snap(knots, nothing, (exact,), stiffness=10.0)
    found = [cubic.at(t)[0][0] for t in times]
    np.testing.assert_allclose(found, exact.values[:, 0], atol=1e-6)


def test_observed_velocities_make_up_for_missing_places():
    knots = np.linspace(0.0, 2.0, 5)
    states, mask = np.zeros((5, STATE_SIZE, 1)), np.zeros((5, STATE_SIZE), dtype=bool)
    mask[0, 0] = True
    times = np.linspace(0.0, 2.0, 50)
    slopes = Observations(times, np.cos(times)[:, None], np.ones(50), derivative=1)
    spline = minimum_snap(knots, FixedStates(states, mask), (slopes,), stiffness=1e-9)
    assert spline.at(2.0)[0][0] == pytest.approx(np.sin(2.0), abs=1e-5)


def test_too_little_to_go_by_is_an_error():
    states, mask = np.zeros((4, STATE_SIZE, 1)), np.zeros((4, STATE_SIZE), dtype=bool)
    mask[:3, 0] = True
    with pytest.raises(np.linalg.LinAlgError, match="too few of its values"):
        minimum_snap(np.arange(4.0), FixedStates(states, mask))


def test_a_spline_goes_on_past_its_ends_as_its_last_pieces_do():
    states = np.zeros((3, STATE_SIZE, 1))
    states[:, 0, 0] = 0.0, 1.0, 4.0
    states[:, 1, 0] = 0.0, 2.0, 4.0
    states[:, 2, 0] = 2.0
    parabola = SepticSpline(np.arange(3.0), states)
    for t in (-0.5, 0.0, 0.7, 1.0, 1.5, 2.0, 2.5):
        assert parabola.at(t)[0] == pytest.approx((t**2, 2.0 * t, 2.0, 0.0), abs=1e-9)
