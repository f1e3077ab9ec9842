"""How late telemetry is, from TIMESYNC exchanges that agree or contradict the samples."""

import pytest

from companion.vehicle.clock_estimates import DelayUnknown, TelemetryDelay


def compared(*exchanges):
    """A delay after exchanges (time, half the round trip, delay), s; and the last answer."""
    delay, answer = TelemetryDelay(), None
    for exchange in exchanges:
        answer = delay.take_exchange(*exchange)
    return delay, answer


def test_an_exchange_gives_the_delay():
    delay, answer = compared((1.0, 0.005, 0.02))
    assert answer is None
    assert delay.known
    assert delay.seconds == 0.02


@pytest.mark.parametrize("known", [(), ((1.0, 0.005, 0.02),)])
def test_two_exchanges_far_behind_are_of_another_clock(known):
    delay, answer = compared(*known, (2.0, 0.005, 900.0), (3.0, 0.005, 900.0))
    assert answer is None
    assert (delay.known, delay.why_unknown) == (False, DelayUnknown.OTHER_CLOCK)


def test_two_exchanges_ahead_are_a_clock_that_jumped_once_the_delay_was_known():
    far = (2.0, 0.005, -3.0), (3.0, 0.005, -3.0)
    delay, answer = compared((1.0, 0.005, 0.02), *far)
    assert answer == pytest.approx(3.02)
    assert delay.known
    delay, answer = compared(*far)
    assert answer is None
    assert (delay.known, delay.why_unknown) == (False, DelayUnknown.OTHER_CLOCK)


def test_the_largest_delay_counts_exchanges_until_then_with_their_errors():
    delay, _ = compared((1.0, 0.005, 0.02), (2.0, 0.004, 0.01))
    assert delay.largest_possible(before=0.9) == 0.0
    assert delay.largest_possible(before=1.0) == pytest.approx(0.025)
    assert delay.largest_possible(before=2.0) == pytest.approx(0.014)
