"""The target moves between two commands, and never past the second."""

from math import inf, pi

import pytest
from hypothesis import given
from hypothesis import strategies as st

from companion.attitude import Target
from companion.control.guidance_command import GuidanceCommand

part = st.floats(-0.8, 0.8)
targets = st.builds(Target, part, part, st.floats(-pi, pi), st.floats(-2.0, 2.0))


def test_halfway_it_is_in_the_middle_and_the_heading_goes_the_short_way():
    command = GuidanceCommand(
        Target(0.1, -0.2, 3.1, 0.0),
        0.0,
        10.0,
        later_target=Target(0.2, 0.0, -3.1, 1.0),
        period=0.02,
    )
    between = command.target_at(10.01)
    assert between == pytest.approx((0.15, -0.1, pi, 0.5))
    assert command.target_at(10.03) == command.later_target


def test_a_command_without_a_later_target_stays():
    command = GuidanceCommand(Target(0.1, 0.2, 0.3), 0.0, 10.0, is_step=True)
    assert all(command.target_at(10.0 + n * 0.01) is command.target for n in range(20))


@given(targets, targets, st.floats(-1.0, 1.0) | st.sampled_from([inf, -inf, float("nan")]))
def test_it_is_never_beyond_either_target(before, after, elapsed):
    at = GuidanceCommand(before, 0.0, 5.0, later_target=after, period=0.02).target_at(5.0 + elapsed)
    for low, value, high in zip(before, at, after, strict=True):
        if low is not before.heading:
            assert min(low, high) - 1e-12 <= value <= max(low, high) + 1e-12
    if not elapsed > 0.0:
        assert at == before
    if elapsed >= 0.03:
        assert at == after
