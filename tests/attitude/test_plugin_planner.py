"""A planner of another package: its rates are checked and limited, all else is passed on."""

from math import hypot, inf, nan

import pytest

from companion.attitude import AttitudeError, BodyRates, Limits, Target
from companion.attitude.plugin_planner import PluginPlanner

Q, TARGET = (1.0, 0.0, 0.0, 0.0), Target(0.1, 0.0, 0.0)


class Another:
    """Returns the rates it is given, and keeps what it was called with."""

    def __init__(self, rates):
        self.answer, self.calls = rates, []

    def rates(self, *arguments):
        self.calls.append(("rates", *arguments))
        return self.answer

    def note_attitude_target(self, *arguments):
        self.calls.append(("target", *arguments))

    def reset(self, *arguments):
        self.calls.append(("reset", *arguments))


def test_roll_and_pitch_are_shortened_together_and_yaw_by_itself():
    limits = Limits(max_tilt_rate=1.0, max_yaw_rate=0.5)
    roll, pitch, yaw = PluginPlanner(Another((3.0, -4.0, -2.0)), limits).rates(Q, TARGET, 0.004)
    assert hypot(roll, pitch) == pytest.approx(1.0)
    assert (roll, pitch, yaw) == pytest.approx((0.6, -0.8, -0.5))


def test_without_limits_the_rates_are_the_planners():
    assert PluginPlanner(Another((3.0, -4.0, 9.0)), Limits()).rates(Q, TARGET, 0.004) == BodyRates(
        3.0, -4.0, 9.0
    )


@pytest.mark.parametrize("rates", [(nan, 0.0, 0.0), (0.0, inf, 0.0), (0.0, 0.0, -inf)])
def test_rates_that_are_not_finite_are_refused(rates):
    with pytest.raises(AttitudeError, match="the planner returned"):
        PluginPlanner(Another(rates), Limits()).rates(Q, TARGET, 0.004)


def test_every_call_reaches_the_planner_with_its_arguments():
    another = Another((0.0, 0.0, 0.0))
    planner, measured = PluginPlanner(another, Limits()), BodyRates(0.1, 0.2, 0.3)
    planner.reset(Q, measured)
    planner.note_attitude_target(Q, 0.05)
    planner.rates(Q, TARGET, 0.004, measured)
    assert another.calls == [
        ("reset", Q, measured),
        ("target", Q, 0.05),
        ("rates", Q, TARGET, 0.004, measured),
    ]
