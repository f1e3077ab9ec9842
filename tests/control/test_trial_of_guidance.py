"""Guidance of another package is asked once before it flies, and must command finite numbers."""

from math import inf, nan
from types import SimpleNamespace

import pytest

from companion.attitude import Target
from companion.config import Config
from companion.control import outer_loop
from companion.control.inner_loop import thrust_limits
from companion.control.outer_loop import make_guidance, make_predictive_control
from companion.drag import NO_DRAG
from companion.files.yaml_file import ConfigError
from companion.guidance.linear import LinearCommand

USUAL = Config()
CONFIG = USUAL.model_copy(update={"guidance": USUAL.guidance.model_copy(update={"kind": "theirs"})})
GOOD = LinearCommand(Target(0.1, 0.2, 0.3), Target(0.4, 0.5, 0.6), -0.5)


class Theirs:
    """Guidance that remembers what it was asked."""

    def __init__(self, settings, command=GOOD, effect_delay=0.1):
        self.settings, self.effect_delay, self._command = settings, effect_delay, command
        self.asked = []

    def command(self, reference, now, inputs):
        self.asked.append((reference(now), now, inputs))
        if isinstance(self._command, BaseException):
            raise self._command
        return self._command


@pytest.fixture
def made(monkeypatch):
    """Makes guidance by a plug-in; returns it, and all that the plug-in made."""

    def make(*arguments):
        theirs = []

        def factory(settings):
            theirs.append(Theirs(settings, *arguments))
            return theirs[-1]

        monkeypatch.setattr(outer_loop, "plugin", lambda *_: factory)
        return make_guidance(CONFIG), theirs

    return make


def test_the_trial_is_of_a_vehicle_at_rest_where_it_should_be(made):
    flown, (tried, other) = made()
    ((reference, now, inputs),) = tried.asked
    assert reference.position_ned == inputs.present.position_ned == (0.0, 0.0, 0.0)
    assert (reference.velocity_ned, inputs.present.velocity_ned) == ((0.0, 0.0, 0.0),) * 2
    assert (now, inputs.predicted, inputs.drag) == (0.0, inputs.present, NO_DRAG)
    assert inputs.thrust == inputs.disturbance == (0.0, 0.0)
    assert inputs.thrust_limits == thrust_limits(CONFIG)
    assert other.asked == [], "the one that flies remembers no trial"
    assert flown.command(lambda _: reference, 0.0, inputs) == GOOD
    assert len(other.asked) == 1


@pytest.mark.parametrize(
    "command",
    [
        GOOD._replace(target=Target(nan, 0.2, 0.3)),
        GOOD._replace(target=Target(0.1, 0.2, 0.3, nan)),
        GOOD._replace(later_target=Target(0.4, inf, 0.6)),
        GOOD._replace(acceleration_down=-inf),
        (GOOD.target, GOOD.later_target),
        None,
        ArithmeticError("no"),
        SystemExit(3),
    ],
)
def test_what_does_not_command_finite_numbers_is_refused(made, command):
    with pytest.raises(ConfigError, match=r"guidance.kind: theirs cannot be flown: "):
        made(command)


def test_a_time_that_is_no_number_is_refused(made):
    with pytest.raises(ConfigError, match=r"`effect_delay` must be finite, .* and nan s"):
        made(GOOD, nan)


@pytest.mark.parametrize("waits", [False, True])
def test_predictive_control_gets_its_settings_and_its_trajectory(monkeypatch, waits):
    asked = []
    monkeypatch.setattr(outer_loop, "Solver", lambda *arguments: asked.append(arguments))
    monkeypatch.setattr(
        outer_loop, "PredictiveControl", lambda start, **keys: SimpleNamespace(start=start, **keys)
    )
    maneuver, notes = SimpleNamespace(trajectory=object()), []
    control = make_predictive_control(USUAL, maneuver, notes.append, vehicle_waits=waits)
    control.start("report")
    ((settings, trajectory, report),) = asked
    assert settings == outer_loop.predictive_settings(USUAL, vehicle_waits=waits)
    assert settings != outer_loop.predictive_settings(USUAL, vehicle_waits=not waits)
    assert (trajectory, report) == (maneuver.trajectory, "report")
    assert (control.period, control.vehicle_waits) == (settings.lead, waits)
    control.note("slow")
    assert notes == ["slow"]
