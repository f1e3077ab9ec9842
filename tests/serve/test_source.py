"""A client's setpoints as a source of guidance: only fresh ones are flown."""

import math

import pytest

from companion.attitude import BodyRates
from companion.guidance.reference import Pose, VehicleMotion
from companion.serve.ownership import Ownership
from companion.serve.setpoints.approach import UnplannableError
from companion.serve.setpoints.motion import CommandedMotion, MotionLimits
from companion.serve.setpoints.request import AxisDemand, MotionRequest, RatesRequest
from companion.serve.source import ServedSource

HOME = Pose((1.0, 2.0, -5.0), 0.5)
STILL = VehicleMotion(HOME.position_ned, (0.0, 0.0, 0.0))
ROLL = RatesRequest(BodyRates(0.8, 0.0, 0.0), 0.4)
LIMITS = MotionLimits(5.0, 4.0, 12.0, 2.0, 1.0, 1.0, 0.5)


def source():
    """A source whose owner sends setpoints at 0 s and 0.1 s."""
    ownership = Ownership(0.5, 2.0)
    for now in (0.0, 0.1):
        ownership.note_setpoint("script", now)
    assert ownership.request_control("script", 0.1) is None
    return ServedSource("script", CommandedMotion(LIMITS), ownership, lambda: 0.5), ownership


@pytest.mark.parametrize(("begins", "flown"), [(0.3, True), (0.7, False), (3.0, False)])
def test_a_setpoint_that_grew_old_in_the_takeover_is_not_flown(begins, flown):
    served, _ = source()
    served.give(ROLL, 0.1)
    served.begin(begins, HOME)
    reference = served.reference(begins, STILL)(begins)
    assert (reference.body_rates is not None) is flown
    if not flown:
        assert reference.position_ned == pytest.approx(HOME.position_ned)
        assert not served.finished(begins + 1.0), "held first"


def test_after_rates_a_request_without_a_motion_is_refused_and_the_rates_still_count():
    served, ownership = source()
    served.begin(0.3, HOME)
    served.give(ROLL, 0.3)
    wild = MotionRequest(
        AxisDemand((0.0, 0.0), None, None), AxisDemand((math.nan,), None, None), None, None
    )
    with pytest.raises(UnplannableError):
        served.give(wild, 0.4)
    assert served.reference(0.4, STILL)(0.4).body_rates == ROLL.rates
    assert served.reference(0.7, STILL)(0.7).body_rates is None, "nobody commands"
    with pytest.raises(UnplannableError):
        served.give(wild, 0.8)
    ownership.note_setpoint("script", 0.9)
    assert served.reference(0.9, STILL)(0.9).velocity_ned == pytest.approx((0.0, 0.0, 0.0))


def test_a_request_without_a_motion_at_the_takeover_is_a_hold():
    served, _ = source()
    served.give(
        MotionRequest(
            AxisDemand((math.nan, 0.0), None, None), AxisDemand((0.0,), None, None), 0, 0
        ),
        0.1,
    )
    served.begin(0.3, HOME)
    assert served.reference(0.3, STILL)(1.0).position_ned == pytest.approx(HOME.position_ned)
