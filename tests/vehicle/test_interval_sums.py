"""The effective rate of setpoints: pauses between bursts lower it."""

import pytest

from companion.vehicle.interval_sums import IntervalSums


def held(*intervals):
    rates = IntervalSums()
    for interval in intervals:
        rates.add(interval)
    return rates


@pytest.mark.parametrize(
    ("intervals", "rate"),
    [
        (10 * [0.02], 50.0),
        (5 * [0.01, 0.03], 50.0),  # 2·Σg/Σg² is 80 Hz, so the mean counts
        ([0.08, *20 * [0.0]], 25.0),  # a pause, and then 21 at once
        ([0.5, 0.0, 0.0, 0.0], 4.0),
    ],
)
def test_the_rate_is_the_mean_one_unless_pauses_dominate(intervals, rate):
    assert held(*intervals).rate_since(IntervalSums()) == pytest.approx(rate)


def test_only_what_came_since_then_counts():
    rates = held(0.5, 0.25)
    before = rates.copy()
    assert (before.count, before.total, before.sum_of_squares) == (2, 0.75, 0.3125)
    assert rates.rate_since(before) is None
    rates.add(0.02)
    assert rates.rate_since(before) == pytest.approx(50.0)
    assert before.count == 2


def test_setpoints_without_any_time_between_them_have_no_rate():
    assert held(0.0, 0.0).rate_since(IntervalSums()) is None
    assert held(1e-170).rate_since(IntervalSums()) is None  # its square is too small for a float
