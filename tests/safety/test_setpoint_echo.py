"""Setpoints of another program, found in what the autopilot reports."""

import struct
from collections import deque
from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from companion.attitude import BodyRates
from companion.safety.setpoint_echo import SetpointEcho

PX4 = SimpleNamespace(rates_about_target_axes=False)
ARDUPILOT = SimpleNamespace(rates_about_target_axes=True)
OURS = [(BodyRates(0.1 * k, -0.2, 0.03), 0.5 + 0.001 * k) for k in range(5)]
RATE = st.floats(-10.0, 10.0)


def single(value):
    return struct.unpack("<f", struct.pack("<f", value))[0]


def report(rates, thrust):
    """An ATTITUDE_TARGET; its numbers are of single precision."""
    roll, pitch, yaw = map(single, rates)
    return SimpleNamespace(
        body_roll_rate=roll, body_pitch_rate=pitch, body_yaw_rate=yaw, thrust=single(thrust)
    )


def echo(autopilot, sent=OURS):
    made = SetpointEcho(deque(sent))
    made.begin(autopilot)
    return made


@given(rates=st.tuples(RATE, RATE, RATE), thrust=st.floats(0.0, 1.0))
def test_a_setpoint_of_ours_is_known_in_single_precision(rates, thrust):
    for autopilot in (PX4, ARDUPILOT):
        heard = echo(autopilot, [*OURS, (BodyRates(*rates), thrust)])
        heard.add_report(report(*OURS[0]), 0.0)
        heard.add_report(report(rates, thrust), 1.0)
        assert heard.foreign_reports(1.0) == 0


@pytest.mark.parametrize("autopilot", [PX4, ARDUPILOT])
def test_each_report_that_fits_no_setpoint_of_ours_counts_for_five_seconds(autopilot):
    heard = echo(autopilot)
    heard.add_report(report(*OURS[2]), 0.0)
    for time in (1.0, 2.0, 3.0):
        heard.add_report(report((0.7, 0.0, 0.0), 0.3), time)
    heard.add_report(report(*OURS[4]), 3.0)
    assert [heard.foreign_reports(now) for now in (3.0, 6.0, 6.5, 8.5)] == [3, 3, 2, 0]


def test_px4_reports_the_rates_and_ardupilot_the_thrust():
    only_rates, only_thrust = report(OURS[0][0], 0.9), report((0.7, 0.0, 0.0), OURS[0][1])
    for autopilot, ours, other in (
        (PX4, only_rates, only_thrust),
        (ARDUPILOT, only_thrust, only_rates),
    ):
        heard = echo(autopilot)
        heard.add_report(ours, 0.0)
        assert heard.foreign_reports(0.0) == 0
        heard.add_report(other, 0.0)
        assert heard.foreign_reports(0.0) == 1


def test_nothing_is_foreign_before_a_report_has_shown_a_setpoint_of_ours():
    heard = echo(PX4)
    for _ in range(9):
        heard.add_report(report((0.7, 0.0, 0.0), 0.3), 0.0)
    assert heard.foreign_reports(0.0) == 0
    heard.add_report(report(*OURS[0]), 0.0)
    heard.add_report(report((0.7, 0.0, 0.0), 0.3), 0.0)
    assert heard.foreign_reports(0.0) == 1
    assert heard.any_foreign
    heard.begin(PX4)
    assert heard.foreign_reports(0.0) == 0
    assert not heard.any_foreign


@pytest.mark.parametrize("autopilot", [PX4, ARDUPILOT])
def test_a_report_with_nan_says_nothing(autopilot):
    heard = echo(autopilot)
    heard.add_report(report(*OURS[0]), 0.0)
    heard.add_report(report((float("nan"), 0.0, 0.0), float("nan")), 0.0)
    assert heard.foreign_reports(0.0) == 0
