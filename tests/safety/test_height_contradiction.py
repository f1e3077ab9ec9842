"""What counts as a height that contradicts its vertical speed."""

from types import SimpleNamespace

import pytest

from companion.safety.height_contradiction import HeightContradiction
from companion.vehicle.records import LocalPosition

DT = 0.05


def unexplained(height, climb, seconds=10.0, shift=lambda t: 0.0):
    """The largest unexplained change in a flight, m; heights m, climbs m/s, shifts of resets m."""
    resets, largest = SimpleNamespace(), 0.0
    monitor = HeightContradiction(resets)
    for k in range(round(seconds / DT)):
        t = k * DT
        resets.position_shift = (0.0, 0.0, shift(t))
        position = LocalPosition(t, t, (0.0, 0.0, -height(t)), (0.0, 0.0, -climb(t)))
        largest = max(largest, monitor.unexplained_change(position))
    return largest


def test_a_climb_that_its_speed_explains_counts_nothing():
    assert unexplained(lambda t: 2.0 * t, lambda t: 2.0) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(("error", "counted"), [(0.1, 0.3), (0.9, 2.7), (-0.9, 2.7)])
def test_an_error_of_the_speed_counts_for_three_seconds(error, counted):
    assert unexplained(lambda t: 5.0, lambda t: error) == pytest.approx(counted, abs=0.05)


def test_jumps_of_the_estimate_are_left_to_the_monitors_of_resets():
    jumped = lambda t: 5.0 if t < 4.0 else 8.0  # noqa: E731
    assert unexplained(jumped, lambda t: 0.0, shift=lambda t: 5.0 - jumped(t)) < 1e-9


def test_after_a_gap_or_a_restart_it_begins_anew():
    monitor = HeightContradiction(SimpleNamespace(position_shift=(0.0, 0.0, 0.0)))
    speed = (0.0, 0.0, 5.0)
    for t, counted in ((0.0, 0.0), (0.4, 2.0), (2.0, 0.0), (1.0, 0.0), (1.2, 1.0)):
        position = LocalPosition(t, t, (0.0, 0.0, 0.0), speed)
        assert monitor.unexplained_change(position) == pytest.approx(counted)
        assert monitor.unexplained_change(position) == pytest.approx(counted)
    monitor.begin()
    assert monitor.unexplained_change(None) == 0.0
