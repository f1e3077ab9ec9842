"""The rotors' curve and the battery: both against what they are defined by."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from companion.guidance.thrust import BatterySag, ThrustCurve

shares = st.floats(0.0, 1.0)


@given(shares, shares)
def test_the_signal_gives_the_share_by_the_autopilots_formula(factor, share):
    signal = ThrustCurve(factor).signal(share)
    assert factor * signal**2 + (1.0 - factor) * signal == pytest.approx(share, abs=1e-9)


@given(shares, shares)
def test_the_share_is_the_autopilots_formula(factor, signal):
    expected = factor * signal**2 + (1.0 - factor) * signal
    assert ThrustCurve(factor).share(signal) == pytest.approx(expected, abs=1e-12)


def test_a_straight_line_is_left_alone():
    assert ThrustCurve(0.0).signal(0.37) == 0.37
    assert ThrustCurve(1.0).signal(0.49) == pytest.approx(0.7)


@pytest.mark.parametrize("factor", [0.0, 0.5, 1.0])
def test_no_thrust_needs_no_signal(factor):
    """A vehicle tilted by 90 degrees or more asks for none; for a parabola that was 0/0."""
    assert ThrustCurve(factor).signal(0.0) == 0.0


def test_thrust_falls_with_the_square_of_the_voltage():
    battery = BatterySag(2.0)
    battery.note_voltage(10.0, 16.0)
    assert battery.factor == 1.0
    battery.note_voltage(10.3, 14.4)
    assert 0.81 < battery.factor < 1.0  # smoothed
    for k in range(50):
        battery.note_voltage(10.5 + 0.2 * k, 14.4)
    assert battery.factor == pytest.approx(0.81, abs=1e-4)


def test_a_message_that_is_seen_twice_counts_once():
    battery = BatterySag(2.0)
    battery.note_voltage(10.0, 16.0)
    battery.note_voltage(10.3, 14.4)
    once = battery.factor
    battery.note_voltage(10.3, 14.4)
    assert battery.factor == once


def test_on_the_ground_it_begins_anew():
    battery = BatterySag(2.0)
    battery.note_voltage(1.0, 16.8)
    battery.note_voltage(3.0, 15.0)
    battery.reset()
    assert battery.factor == 1.0
    battery.note_voltage(5.0, 15.0)
    battery.note_voltage(7.0, 15.0)
    assert battery.factor == 1.0


@pytest.mark.parametrize("garbage", [None, math.nan, math.inf, 0.0, -3.0, 5.0, 65.0])
def test_a_broken_reading_is_no_sag(garbage):
    battery = BatterySag(2.0)
    battery.note_voltage(1.0, 16.0)
    battery.note_voltage(3.0, 15.0)
    before = battery.factor
    battery.note_voltage(5.0, garbage)
    assert battery.factor == before


@pytest.mark.parametrize("garbage", [None, math.nan, 0.0])
def test_a_broken_first_reading_is_not_what_sag_is_measured_from(garbage):
    battery = BatterySag(2.0)
    battery.note_voltage(0.5, garbage)
    battery.note_voltage(1.0, 16.0)
    for k in range(50):
        battery.note_voltage(2.0 + k, 14.4)
    assert battery.factor == pytest.approx(0.81)


def test_an_exponent_of_zero_turns_it_off():
    battery = BatterySag(0.0)
    battery.note_voltage(1.0, 16.0)
    battery.note_voltage(3.0, 12.0)
    assert battery.factor == 1.0
