"""`exact` within its limits, and with its heading moving: SciPy judges every single sample."""

import numpy as np
import pytest

from companion.attitude import Limits, Target, make_planner
from companion.attitude.exact import SHORTEST_PERIOD
from tests.attitude.independent import (
    attitudes,
    coefficients_of,
    headings_of,
    held,
    rate_between,
    wrapped,
)
from tests.attitude.simulate import answers

COUNT = 2000
GAIN, YAW_GAIN = 5.0, 2.0
W_M = np.pi / 2
YAW_RATE = 0.6


class Sample:
    """One sample from many random attitudes: what was asked, answered and reached."""

    def __init__(self, dt, heading_error=3.1, heading_rate=0.0, **limits):
        rng = np.random.default_rng(33)
        length = np.sqrt(rng.uniform(0.0, 0.8**2, (2, COUNT)))
        bearing = rng.uniform(-np.pi, np.pi, (2, COUNT))
        self.c, self.goal = np.moveaxis(length * [np.cos(bearing), np.sin(bearing)], 0, 2)
        self.heading = rng.uniform(-np.pi, np.pi, COUNT)
        self.error = rng.uniform(-heading_error, heading_error, COUNT)
        self.dt = dt
        self.r = attitudes(self.c, self.heading)
        asked = np.column_stack([self.goal, self.heading + self.error])
        targets = [Target(*row, heading_rate) for row in asked.tolist()]
        planner = make_planner("exact", GAIN, YAW_GAIN, limits=Limits(**limits))
        self.rates = answers(planner, self.r, targets, dt)
        self.then = held(self.r, self.rates, dt)
        self.line = self.goal - self.c
        moved = coefficients_of(self.then) - self.c
        self.square = np.sum(self.line**2, axis=1)
        self.part = np.sum(moved * self.line, axis=1) / self.square
        self.off_line = np.linalg.norm(moved - self.part[:, None] * self.line, axis=1)
        self.turn = wrapped(headings_of(self.then) - self.heading)

    def needed(self, part, turn):
        """The rates that would lead to this part of the line with this turn of the heading."""
        then = attitudes(self.c + part[:, None] * self.line, self.heading + turn)
        return rate_between(self.r, then, self.dt)

    @property
    def whole(self):
        """The part of the line that the model covers in the sample."""
        return 1.0 - np.exp(-GAIN * self.dt)


def tilt_rate(rates):
    return np.hypot(rates[:, 0], rates[:, 1])


RATES_HZ = [1000, 250, 50, 20]


@pytest.mark.parametrize("rate", RATES_HZ)
def test_the_tilt_limit_is_used_up_and_the_line_kept(rate):
    sample = Sample(1.0 / rate, max_tilt_rate=W_M)
    used = tilt_rate(sample.rates)
    assert used.max() <= W_M * (1.0 + 1e-12)
    assert sample.off_line.max() <= 1e-12
    short = sample.part < sample.whole * (1.0 - 1e-9)
    assert 0.2 < short.mean() < 0.95
    assert used[short] == pytest.approx(W_M, rel=1e-9)
    assert sample.part[~short] == pytest.approx(sample.whole, rel=1e-9)
    assert (sample.part >= 0.0).all()
    # The heading is not held back by the limit on the tilt.
    asked = (1.0 - np.exp(-YAW_GAIN * sample.dt)) * sample.error
    assert sample.turn == pytest.approx(asked, abs=1e-12)


@pytest.mark.parametrize("rate", RATES_HZ)
def test_no_point_farther_along_the_line_is_within_the_limit(rate):
    sample = Sample(1.0 / rate, max_tilt_rate=W_M)
    short = sample.part < sample.whole * (1.0 - 1e-9)
    for share in (1e-6, 1e-3, 0.03, 0.1, 0.3, 0.6, 1.0):
        farther = sample.part + share * (sample.whole - sample.part)
        clear = short & (farther > sample.part * (1.0 + 1e-9))
        assert (tilt_rate(sample.needed(farther, sample.turn))[clear] > W_M).all()
    nearer = sample.part * (1.0 - 1e-6)
    assert (tilt_rate(sample.needed(nearer, sample.turn))[short] < W_M).all()


@pytest.mark.parametrize("rate", RATES_HZ)
def test_both_limits_at_once(rate):
    sample = Sample(1.0 / rate, max_tilt_rate=W_M, max_yaw_rate=YAW_RATE)
    yaw = np.abs(sample.rates[:, 2])
    assert tilt_rate(sample.rates).max() <= W_M * (1.0 + 1e-12)
    assert yaw.max() <= YAW_RATE * (1.0 + 1e-12)
    assert sample.off_line.max() <= 1e-12
    short = sample.part < sample.whole * (1.0 - 1e-9)
    assert tilt_rate(sample.rates)[short] == pytest.approx(W_M, rel=1e-9)
    assert sample.part[~short] == pytest.approx(sample.whole, rel=1e-9)
    asked = (1.0 - np.exp(-YAW_GAIN * sample.dt)) * sample.error
    awaiting_mode = np.abs(sample.turn - asked) > 1e-9
    assert 0.2 < awaiting_mode.mean() < 0.98
    assert yaw[awaiting_mode] == pytest.approx(YAW_RATE, rel=1e-9)
    # And it is held back no more than that: a little more of the turn asked would be too fast.
    further = sample.turn + 1e-6 * (asked - sample.turn)
    beyond = np.abs(sample.needed(sample.part, further)[:, 2]) > YAW_RATE
    clear = np.abs(asked - sample.turn) > 1e-6
    assert beyond[awaiting_mode & clear].all()


@pytest.mark.parametrize("rate", [1000, 250, 100, 50])
def test_the_heading_error_shrinks_exactly_while_the_target_turns(rate):
    sample = Sample(1.0 / rate, heading_error=2.0, heading_rate=0.8)
    left = sample.error + 0.8 * sample.dt - sample.turn
    assert left == pytest.approx(sample.error * np.exp(-YAW_GAIN * sample.dt), abs=1e-12)
    assert sample.part == pytest.approx(sample.whole, rel=1e-9)


def test_a_turning_target_is_followed_without_lag():
    """A second at 50 Hz: the heading keeps up with its target, the tilt stands still."""
    dt, speed = 0.02, 1.1
    c = np.array([0.3, -0.4])
    r = attitudes(c, [2.9])
    planner = make_planner("exact", GAIN, YAW_GAIN)
    for step in range(50):
        heading = 2.9 + speed * step * dt
        assert wrapped(headings_of(r)[0] - heading) == pytest.approx(0.0, abs=1e-12)
        r = held(r, answers(planner, r, [Target(*c, heading, speed)], dt), dt)
        assert np.abs(coefficients_of(r)[0] - c).max() < 1e-12


@pytest.mark.parametrize("rate", [1000, 100, 20])
def test_in_the_shape_of_the_paper_the_speed_is_limited(rate):
    max_tilt = np.radians(60.0)
    speed = W_M * np.cos(max_tilt)
    sample = Sample(1.0 / rate, max_tilt=max_tilt, max_tilt_rate=W_M, shape="paper")
    covered = sample.part * np.sqrt(sample.square)
    assert covered.max() <= speed * sample.dt * (1.0 + 1e-9)
    limited = GAIN * np.sqrt(sample.square) * np.exp(-GAIN * sample.dt) > speed
    assert 0.3 < limited.mean() < 1.0
    assert covered[limited] == pytest.approx(speed * sample.dt, rel=1e-9)
    assert sample.off_line.max() <= 1e-12


@pytest.mark.parametrize(
    "limits", [{}, {"max_tilt_rate": W_M}, {"max_tilt_rate": W_M, "max_yaw_rate": YAW_RATE}]
)
def test_a_short_sample_is_answered_like_first_order(limits):
    """Their rates differ by O(dt); from `SHORTEST_PERIOD` down by nothing more."""
    sample = Sample(0.01, **limits)
    asked = np.column_stack([sample.goal, sample.heading + sample.error])
    targets = [Target(*row) for row in asked.tolist()]
    exact = make_planner("exact", GAIN, YAW_GAIN, limits=Limits(**limits))
    law = make_planner("first-order", GAIN, YAW_GAIN, limits=Limits(**limits))
    rates = answers(law, sample.r, targets, 0.01)
    apart = {
        dt: np.abs(answers(exact, sample.r, targets, dt) - rates).max() / dt
        for dt in (1e-2, 1e-3, SHORTEST_PERIOD)
    }
    assert max(apart.values()) < 2.0 * min(apart.values()) < 400.0
    shortest = answers(exact, sample.r, targets, SHORTEST_PERIOD)
    assert (answers(exact, sample.r, targets, 1e-6) == shortest).all()


@pytest.mark.parametrize("rate", RATES_HZ)
def test_the_line_is_kept_where_the_limit_only_just_acts(rate):
    """The limit lies so little below the rate needed that the heading's turn decides it."""
    sample = Sample(1.0 / rate)
    asked = np.column_stack([sample.goal, sample.heading + sample.error])
    for row, target in enumerate(asked[:100].tolist()):
        r = sample.r[row : row + 1]
        bound = float(tilt_rate(sample.rates)[row]) * (1.0 - 1e-6)
        planner = make_planner("exact", GAIN, YAW_GAIN, limits=Limits(max_tilt_rate=bound))
        rates = answers(planner, r, [Target(*target)], sample.dt)
        assert tilt_rate(rates)[0] <= bound * (1.0 + 1e-12)
        moved = coefficients_of(held(r, rates, sample.dt))[0] - sample.c[row]
        part = moved @ sample.line[row] / sample.square[row]
        assert np.linalg.norm(moved - part * sample.line[row]) <= 1e-12
