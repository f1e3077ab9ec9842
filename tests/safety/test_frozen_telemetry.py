"""When telemetry that repeats itself counts as frozen, judged without a flight."""

from types import SimpleNamespace

import pytest

from companion.attitude import BodyRates
from companion.safety.frozen_telemetry import FrozenTelemetry

PERIOD = 0.02
UPRIGHT = (1.0, 0.0, 0.0, 0.0)
STILL = BodyRates(0.0, 0.0, 0.0)


def found_after(seconds, *, attitude=lambda _: None, rates=STILL, position=lambda _: None):
    """What is found, and when, s; `attitude` and `position` give (received, *numbers) at a time."""
    telemetry = FrozenTelemetry()
    for k in range(1, round(seconds / PERIOD) + 1):
        now = k * PERIOD
        told, place = attitude(now), position(now)
        sample = told and SimpleNamespace(received=told[0], q=told[1])
        place = place and SimpleNamespace(
            received=place[0], position_ned=(place[1], 0.0, 0.0), velocity_ned=(place[2], 0.0, 0.0)
        )
        found = telemetry.find_frozen(now, sample, rates, place)
        if found is not None:
            return found, now
    return None, seconds


@pytest.mark.parametrize(
    "speed", [lambda _: 0.1, lambda _: -0.1, lambda now: 0.1 * (-1) ** (now > 0.3)]
)
def test_a_position_that_repeats_although_the_vehicle_moves_is_frozen_after_half_a_second(speed):
    found, at = found_after(2.0, position=lambda now: (now, 7.0, speed(now)))
    assert "repeats one position" in found
    assert at == pytest.approx(0.02 + 0.5, abs=0.021)


def test_a_slow_vehicle_must_have_moved_by_2_cm():
    _, at = found_after(2.0, position=lambda now: (now, 7.0, 0.02))
    assert at == pytest.approx(1.0, abs=0.05)


def test_a_message_that_is_read_again_is_no_repetition():
    """Positions at 2 Hz, judged 50 times a second: ten repetitions take 5 s."""
    _, at = found_after(8.0, position=lambda now: (now // 0.5, 7.0, 1.0))
    assert at == pytest.approx(5.0, abs=0.6)


def test_a_position_that_moves_now_and_then_is_not_frozen():
    """An estimator may move its position at 5 Hz."""
    found, _ = found_after(4.0, position=lambda now: (now, now // 0.2 * 0.2, 1.0 + 1e-6 * now))
    assert found is None


def test_a_velocity_that_repeats_although_the_positions_show_another_one_is_frozen():
    found, at = found_after(3.0, position=lambda now: (now, 0.5 * now, 0.0))
    assert "repeats one velocity" in found
    assert at == pytest.approx(0.52, abs=0.05)
    assert found_after(3.0, position=lambda now: (now, 0.5 * now, 0.5)) == (None, 3.0)


@pytest.mark.parametrize(("rate", "seconds"), [(1.0, 0.22), (0.1, 0.54)])
def test_an_attitude_that_repeats_although_setpoints_turn_the_vehicle_is_frozen(rate, seconds):
    found, at = found_after(
        2.0, attitude=lambda now: (now, UPRIGHT), rates=BodyRates(0.0, rate, 0.0)
    )
    assert "repeats one attitude" in found
    assert at == pytest.approx(seconds, abs=0.021)


def test_an_attitude_that_changes_now_and_then_or_is_not_turned_is_not_frozen():
    turning = BodyRates(0.0, 0.0, 0.3)
    changing = lambda now: (now, (1.0, 1e-7 * (now // 0.18), 0.0, 0.0))  # noqa: E731
    assert found_after(4.0, attitude=changing, rates=turning) == (None, 4.0)
    assert found_after(4.0, attitude=lambda now: (now, UPRIGHT)) == (None, 4.0)
