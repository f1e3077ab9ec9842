"""A long or noisy record takes no longer than a fit may, and tells the same."""

import numpy as np
import pytest

from companion.identification import delayed_model, fit_rate_response
from companion.identification.record import most_excited_windows, segments

from .vehicles import RATE_NOISE, Doublets, lag_with_dead_time, regular

RATE_HZ = 250


def record(*, calm, noise, lag, dead_time, **kind):
    """Doublets behind `calm` seconds of next to nothing, under commands as noisy as `noise`."""
    rng = np.random.default_rng(0)
    doublets = Doublets((0.5, 1.0), 0.4)
    flown = regular(doublets.end, RATE_HZ)
    commanded = doublets.at(flown) + rng.normal(0.0, noise, flown.size)
    rates = lag_with_dead_time(flown, commanded, lag, dead_time, **kind)
    before = regular(calm, RATE_HZ)
    times = np.concatenate((before, calm + flown))
    commanded = np.concatenate((rng.normal(0.0, 0.01, before.size), commanded))
    rates = np.concatenate((np.zeros(before.size), rates))
    return times, commanded, times, rates + rng.normal(0.0, RATE_NOISE, times.size)


@pytest.fixture
def work(monkeypatch):
    """Sizes of what each step of a fit went through: pieces of commands, and samples."""
    sizes = []

    def counted(response):
        def count(commands, *shape_and_times):
            sizes.append(commands.time.size + shape_and_times[-1].size)
            return response(commands, *shape_and_times)

        return count

    for name in ("first_order_response", "second_order_response"):
        monkeypatch.setattr(delayed_model, name, counted(getattr(delayed_model, name)))
    return sizes


@pytest.mark.parametrize("slew", [None, 19.2])
def test_half_an_hour_at_250_hz_is_fitted_by_its_liveliest_part(work, slew):
    limited = {} if slew is None else {"slew": slew}
    given = record(calm=1800.0, noise=0.01, lag=0.03, dead_time=0.04, **limited)
    found = fit_rate_response(*given)
    assert found.lag == pytest.approx(0.03, rel=0.05)
    assert found.dead_time == pytest.approx(0.04, abs=0.001)
    assert found.slew == (None if slew is None else pytest.approx(slew, rel=0.03))
    assert found.is_good(), found.flaw()
    assert max(work) < 40_000
    assert sum(work) < 15_000_000  # about 1 s; the whole record would be 50 times as much


def test_noisy_commands_behind_a_slew_limit_are_little_work(work):
    given = record(calm=30.0, noise=0.05, lag=0.06, dead_time=0.16, slew=4.7)
    found = fit_rate_response(*given)
    assert found.slew == pytest.approx(4.7, rel=0.03)
    assert found.lag == pytest.approx(0.06, rel=0.1)
    assert sum(work) < 10_000_000


def test_of_a_long_record_what_moved_most_is_kept_with_the_commands_before_it():
    times, commanded, _, rates = record(calm=300.0, noise=0.0, lag=0.03, dead_time=0.04)
    whole = segments(times, commanded, times, rates)
    kept = most_excited_windows(whole)
    assert sum(part.time.size + part.measured_time.size for part in kept) <= 16_000
    doublets = times[np.abs(commanded) > 0.4]
    sampled = np.concatenate([part.measured_time for part in kept])
    assert np.isin(doublets, sampled).all()
    for part in kept:
        assert part.time[0] <= max(part.measured_time[0] - 1.5, times[0])
        assert part.time[-1] >= part.measured_time[-1] - 1.0 / RATE_HZ


def test_a_record_that_is_short_is_kept_whole():
    times, commanded, _, rates = record(calm=10.0, noise=0.0, lag=0.03, dead_time=0.04)
    whole = segments(times, commanded, times, rates)
    assert most_excited_windows(whole) is whole
