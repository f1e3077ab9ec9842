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


@pytest.mark.parametrize(
    ("second", "agree"), [(900.059, True), (899.941, True), (900.061, False), (899.939, False)]
)
def test_two_implausible_delays_agree_within_their_errors_and_timesyncs_lag(second, agree):
    delay, _ = compared((1.0, 0.005, 0.02), (2.0, 0.005, 900.0), (3.0, 0.005, second))
    assert delay.known is not agree


def test_an_implausible_delay_counts_only_beside_another_one_just_before():
    delay, _ = compared((1.0, 0.005, 900.0), (2.0, 0.005, 0.02), (3.0, 0.005, 900.0))
    assert (delay.known, delay.seconds) == (True, 0.02)
    delay.take_exchange(4.0, 0.005, 900.0)
    assert not delay.known


def test_a_quicker_sample_shortens_the_delay_of_every_exchange():
    delay, _ = compared((1.0, 0.005, 0.08), (2.0, 0.004, 0.09))
    delay.shorten(0.05, 2.5)
    assert delay.seconds == pytest.approx(0.04)  # of the newer one, which is surer
    assert delay.largest_possible(before=1.0) == pytest.approx(0.035)
    delay.shorten(0.05, 2.5)
    assert delay.seconds == 0.0  # never negative


def test_the_largest_delay_counts_exchanges_until_then_with_their_errors():
    delay, _ = compared((1.0, 0.005, 0.02), (2.0, 0.004, 0.01))
    assert delay.largest_possible(before=0.9) == 0.0
    assert delay.largest_possible(before=1.0) == pytest.approx(0.025)
    assert delay.largest_possible(before=2.0) == pytest.approx(0.014)
