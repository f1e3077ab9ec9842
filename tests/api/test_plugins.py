"""Planners and guidance of another package: found, checked, flown, limited."""

import re
import sys
from importlib import invalidate_caches
from math import hypot, isfinite, nan

import pytest

from companion.attitude import AttitudeError, BodyRates, InvalidTargetError, Limits, Target
from companion.attitude.plugin_planner import PluginPlanner
from companion.cli.main import main
from companion.config import Config
from companion.control.inner_loop import planner
from companion.control.outer_loop import make_guidance
from companion.drag import Drag
from companion.files.yaml_file import ConfigError, parse
from companion.guidance import GuidanceInput, Reference, VehicleMotion
from companion.testing import check_guidance, check_planner, conformance, fly
from tests.flight.fly import CONFIGS, QUICK_FLIGHT, QuickVehicle, merged

CODE = """
import sys
from companion.attitude import AttitudeError
from companion.attitude.first_order import first_order
from companion.guidance.linear import LinearGuidance

def mine(q, target, dt, constants):
    return first_order(q, target, dt, constants)

def nothing(q, target, dt, constants):
    return float("nan"), 0.0, 0.0

def pair(q, target, dt, constants):
    return 0.0, 0.0

def raising(q, target, dt, constants):
    raise RuntimeError("no")

def later(q, target, dt, constants):
    if q[1] > 0.02:
        raise RuntimeError("not at this roll")
    return first_order(q, target, dt, constants)

def blank(q, target, dt, constants):
    return first_order(q, target, dt, constants) if q[1] < 0.02 else (float("nan"), 0.0, 0.0)

def refusing(q, target, dt, constants):
    if q[1] > 0.02:
        raise AttitudeError("not at this roll")
    return first_order(q, target, dt, constants)

def leaving(q, target, dt, constants):
    if q[1] > 0.02:
        raise SystemExit(3)
    return first_order(q, target, dt, constants)

number = 5

def wild(q, target, dt, constants):
    roll, pitch, yaw = first_order(q, target, dt, constants)
    return 100.0 * roll, 100.0 * pitch, yaw

def lazy(q, target, dt, constants):
    return 0.0, 0.0, 0.0

def one_sided(q, target, dt, constants):
    return q[0], 0.0, 0.0

class Remembering:
    def __init__(self, constants):
        self.constants, self.made = constants, 0
    def rates(self, q, target, dt, body_rates=None):
        self.made += 1
        return first_order(q, target, dt, self.constants)
    def note_attitude_target(self, q, age):
        pass
    def reset(self, q, body_rates=None):
        self.made = 0

class Calm(LinearGuidance):
    pass

class Drifting(LinearGuidance):
    def command(self, reference_at, time, inputs):
        def aside(at):
            reference = reference_at(at)
            north, east, down = reference.position_ned
            return reference._replace(position_ned=(north + 3.0, east, down))
        return super().command(aside, time, inputs)

class Forgetful(Remembering):
    def rates(self, q, target, dt, body_rates=None):
        self.made += 1
        return first_order(q, target, dt, self.constants)
    def reset(self, q, body_rates=None):
        raise OSError("no memory")

class Stumbling(LinearGuidance):
    def command(self, reference_at, time, inputs):
        if inputs.present.position_ned[0] > 0.5:
            return self.direction()
        return super().command(reference_at, time, inputs)
    def direction(self):
        return {}["north"]

class Quitting(Stumbling):
    def direction(self):
        sys.exit()

class Vanishing(Stumbling):
    def direction(self):
        return None

class Half:
    def __init__(self, settings):
        pass

class Empty(LinearGuidance):
    def command(self, reference_at, time, inputs):
        return None

class Nowhere(LinearGuidance):
    def command(self, reference_at, time, inputs):
        return super().command(reference_at, time, inputs)._replace(acceleration_down=float("nan"))

class Greedy(LinearGuidance):
    def command(self, reference_at, time, inputs):
        target, later, down = super().command(reference_at, time, inputs)
        return target, later, -1e6 if inputs.present.velocity_ned[0] > 0.5 else down

class Unset(Stumbling):
    def direction(self):
        return (None, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0

class Broken(LinearGuidance):
    def command(self, reference_at, time, inputs):
        target, later, down = super().command(reference_at, time, inputs)
        moving = inputs.present.position_ned[0] > 0.5
        return (target, later, float("nan")) if moving else (target, later, down)
"""
FUNCTIONS = "mine nothing pair raising later blank refusing leaving number wild lazy one_sided"
GUIDANCES = "Calm Drifting Broken Greedy Unset Stumbling Quitting Vanishing Half Empty Nowhere"
ENTRY_POINTS = "\n".join(
    (
        "[companion.planners]",
        *(f"{name.replace('_', '-')} = theirs:{name}" for name in FUNCTIONS.split()),
        "remembering = theirs:Remembering",
        "forgetful = theirs:Forgetful",
        "missing = theirs:not_there",
        "[companion.guidance]",
        *(f"{name.lower()} = theirs:{name}" for name in GUIDANCES.split()),
        "number = theirs:number",
        "my-guidance = my_package:MyGuidance",
    )
)
PAGE = (CONFIGS.parent / "docs/extending.md").read_text("utf-8")
(SHOWN,) = re.findall(r'^```python title="my_package\.py"\n(.*?)^```$', PAGE, re.M | re.S)


@pytest.fixture(autouse=True)
def installed(tmp_path, monkeypatch):
    """A package with plug-ins, installed as pip does."""
    (tmp_path / "theirs.py").write_text(CODE)
    (tmp_path / "my_package.py").write_text(SHOWN)
    info = tmp_path / "their_package-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: their-package\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(ENTRY_POINTS)
    monkeypatch.syspath_prepend(tmp_path)
    invalidate_caches()
    yield
    for module in ("theirs", "my_package"):
        sys.modules.pop(module, None)


def told(role, name, raised, line):
    """The result of a flight that an error of `theirs.py` ended; `line` of it, empty for none."""
    path = sys.modules["theirs"].__file__
    number = next((k for k, text in enumerate(CODE.splitlines(), 1) if text.strip() == line), 0)
    place = f" ({path}:{number})" if line else ""
    return (
        f"an error outside this program: the {role} {name} of the module theirs raised {raised}"
        f"{place}; the vehicle is handed back"
    )


def config(text):
    return parse(text, "test", Config)


@pytest.mark.parametrize("name", ["mine", "remembering"])
def test_a_planner_of_another_package_flies_by_its_name(name):
    vehicle = QuickVehicle("px4")
    summary = fly(merged(QUICK_FLIGHT, {"planner": {"name": name}}), vehicle)
    assert (summary.result, summary.planner) == ("ok", name)
    assert summary.tracking()["position_max_m"] < 0.5


def test_what_it_commands_is_limited():
    told = config("planner: {name: wild}\nlimits: {max_tilt_rate_deg_s: 60}")
    rates = planner(told).rates((1.0, 0.0, 0.0, 0.0), Target(0.4, 0.3, 0.0), 0.004)
    assert hypot(rates.roll, rates.pitch) == pytest.approx(told.limits.max_tilt_rate)


def test_rates_that_are_not_finite_are_refused():
    class Nothing:
        def rates(self, *_):
            return nan, 0.0, 0.0

    with pytest.raises(AttitudeError, match="not finite rates"):
        PluginPlanner(Nothing(), Limits()).rates((1.0, 0.0, 0.0, 0.0), Target(0.4, 0.3, 0.0), 0.004)
    with pytest.raises(InvalidTargetError):
        planner(config("planner: {name: mine}")).rates(
            (1.0, 0.0, 0.0, 0.0), Target(nan, 0.0, 0.0), 0.004
        )


def test_the_rest_of_a_planner_is_passed_on():
    class Spy:
        def rates(self, *_):
            return BodyRates(0.0, 0.0, 0.0)

        def reset(self, *arguments):
            self.was_reset = arguments

        def note_attitude_target(self, *arguments):
            self.noted = arguments

    spy = Spy()
    made = PluginPlanner(spy, Limits())
    made.reset((1.0, 0.0, 0.0, 0.0), None)
    made.note_attitude_target((1.0, 0.0, 0.0, 0.0), 0.1)
    assert spy.was_reset == ((1.0, 0.0, 0.0, 0.0), None)
    assert spy.noted == ((1.0, 0.0, 0.0, 0.0), 0.1)


@pytest.fixture
def quick(monkeypatch):
    """Vehicles of `check_guidance` boot, climb and land quickly, and fly a quarter of a circle."""
    short = {"hover": {"duration_s": 0.5}, "circle": {"laps": 0.25}, "link": QUICK_FLIGHT["link"]}
    short["flight"] = {"takeoff_height_m": 2.0}
    monkeypatch.setattr(conformance, "MockVehicle", QuickVehicle)
    monkeypatch.setattr(
        conformance, "fly", lambda changes, vehicle: fly(merged(short, changes), vehicle)
    )


@pytest.mark.usefixtures("quick")
def test_guidance_of_another_package_flies_by_its_name():
    assert type(make_guidance(config("guidance: {kind: calm}")).guidance).__name__ == "Calm"
    check_guidance("calm")


@pytest.mark.usefixtures("quick")
def test_the_guidance_of_the_page_flies_and_corrects_a_part_at_most():
    check_guidance("my-guidance")
    still = VehicleMotion((0.0, 0.0, -5.0), (0.0, 0.0, 0.0))
    inputs = GuidanceInput(still, still, (0.0, 0.0), (0.0, 0.0), Drag(0.3), (5.0, 18.0))

    def tilt(kind, away):
        guidance = make_guidance(config(f"guidance: {{kind: {kind}}}"))
        reference = Reference((0.6 * away, 0.8 * away, -5.0))
        target = guidance.command(lambda _: reference, 0.0, inputs).target
        return target.north, target.east

    assert tilt("my-guidance", 0.1) == pytest.approx(tilt("linear", 0.1))
    assert tilt("my-guidance", 8.0) == pytest.approx(tilt("linear", 0.2))
    assert hypot(*tilt("linear", 0.2)) < 0.7 * hypot(*tilt("linear", 8.0))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("planner: {name: their}", "unknown planner 'their'; known: auto, .*, lazy, leaving, mine"),
        ("guidance: {kind: their}", "unknown guidance 'their'; known: linear, nmpc, broken, calm"),
    ],
)
def test_an_unknown_name_is_answered_with_those_that_are_installed(text, message):
    with pytest.raises(ConfigError, match=message):
        config(text)


def test_a_plug_in_that_cannot_be_loaded_is_one_sentence():
    told = config("planner: {name: missing}")
    with pytest.raises(ConfigError, match=r"'missing' \(theirs:not_there of their-package\)"):
        planner(told)


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("planner: {name: nothing}", r"the planner returned \(nan"),
        ("planner: {name: pair}", r"returned \(0.0, 0.0\), not three"),
        (
            "planner: {name: raising}",
            r"RuntimeError: no \(.*theirs.py:17\); `companion.testing.check_pl",
        ),
        ("planner: {name: number}", "unknown planner 5"),
        ("guidance: {kind: number}", "guidance.kind: number cannot be made: TypeError"),
        ("guidance: {kind: half}", "half cannot be flown: AttributeError.*linear.Guidance"),
        ("guidance: {kind: empty}", "empty cannot be flown: TypeError.*NoneType.*linear.Guidance"),
        (
            "guidance: {kind: nowhere}",
            "nowhere .*its command and `effect_delay` must be finite.*acceleration_down=nan",
        ),
    ],
)
def test_what_cannot_fly_is_found_before_the_vehicle_is_asked(text, why, tmp_path, capsys):
    path = tmp_path / "c.yaml"
    path.write_text(text)
    for command in (["check-config", str(path)], ["fly", "--config", str(path)]):
        assert main(command) == 2
        assert re.search(why, " ".join(capsys.readouterr().err.split()))


@pytest.mark.parametrize(
    ("name", "raised", "line"),
    [
        ("later", "RuntimeError: not at this roll", 'raise RuntimeError("not at this roll")'),
        ("leaving", "SystemExit: 3", "raise SystemExit(3)"),
    ],
)
def test_a_planner_that_fails_in_flight_is_named_and_the_vehicle_is_landed(name, raised, line):
    vehicle = QuickVehicle("px4")
    flight = {"planner": {"name": name}, "flight": {"maneuvers": ["circle"]}}
    summary = fly(merged(QUICK_FLIGHT, flight), vehicle)
    assert summary.result == told("planner", name, raised, line)
    assert not vehicle.state()["crashed"]


def test_a_planner_that_fails_before_take_off_is_named_and_nothing_is_handed_back():
    vehicle = QuickVehicle("px4")
    summary = fly(merged(QUICK_FLIGHT, {"planner": {"name": "forgetful"}}), vehicle)
    line = 'raise OSError("no memory")'
    assert f"{summary.result}; the vehicle is handed back" == told(
        "planner", "Forgetful", "OSError: no memory", line
    )
    assert vehicle.state()["on_ground"]


@pytest.mark.parametrize("name", ["blank", "refusing"])
def test_a_planner_without_rates_is_named_and_the_attitude_is_not_blamed(name):
    vehicle = QuickVehicle("px4")
    flight = {"planner": {"name": name}, "flight": {"maneuvers": ["circle"]}}
    summary = fly(merged(QUICK_FLIGHT, flight), vehicle)
    assert summary.result == (
        f"the planner (planner.name: {name}) gives no body rates: they are NaN or infinite, or it "
        "refuses the target"
    )
    assert not vehicle.state()["crashed"]


def test_thrust_that_the_vehicle_does_not_have_is_not_taken_for_motion():
    """The estimate must not believe that a million m/s² carries the vehicle out of the fence."""
    vehicle = QuickVehicle("px4")
    flight = {"guidance": {"kind": "greedy"}, "flight": {"maneuvers": ["circle"]}}
    summary = fly(merged(QUICK_FLIGHT, flight), vehicle)
    assert "limits.fence_radius_m" not in summary.result
    assert not vehicle.state()["crashed"]


@pytest.mark.parametrize(
    ("autopilot", "kind", "raised", "line"),
    [
        ("px4", "stumbling", "KeyError: 'north'", 'return {}["north"]'),
        ("ardupilot", "stumbling", "KeyError: 'north'", 'return {}["north"]'),
        ("px4", "quitting", "SystemExit", "sys.exit()"),
        ("px4", "vanishing", "TypeError: cannot unpack non-iterable NoneType object", ""),
        (
            "px4",
            "unset",
            "TypeError: float() argument must be a string or a real number, not 'NoneType'",
            "",
        ),
    ],
)
def test_guidance_that_fails_in_flight_is_named_and_the_vehicle_is_handed_back(
    autopilot, kind, raised, line
):
    vehicle = QuickVehicle(autopilot)
    flight = {"guidance": {"kind": kind}, "flight": {"maneuvers": ["circle"]}}
    summary = fly(merged(QUICK_FLIGHT, flight), vehicle)
    assert summary.result == told("guidance", kind.capitalize(), raised, line)
    assert not any("internal error" in text for _, text in summary.events)
    assert (vehicle.state()["armed"], vehicle.state()["crashed"]) == (False, False)  # landed


@pytest.mark.parametrize("name", ["first-order", "exact", "quaternion", "mine", "remembering"])
def test_good_planners_conform(name):
    check_planner(name)


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("nothing", "are not finite"),
        ("wild", "exceeds the limit"),
        ("lazy", "away from"),
        ("one-sided", "q and −q"),
    ],
)
def test_bad_planners_do_not(name, why):
    with pytest.raises(AssertionError, match=why):
        check_planner(name)


def test_a_planner_that_raises_does_not_conform():
    def fails(q, target, dt, constants):
        if q != (1.0, 0.0, 0.0, 0.0):
            raise RuntimeError("not at this attitude")
        return 0.0, 0.0, 0.0

    with pytest.raises(AssertionError, match=r"the planner raised RuntimeError.* at q = "):
        check_planner(fails)


@pytest.mark.usefixtures("quick")
def test_guidance_that_strays_does_not_conform():
    with pytest.raises(AssertionError, match="away from its reference"):
        check_guidance("drifting")


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
def test_guidance_that_is_not_finite_is_never_sent_and_the_vehicle_is_handed_back(autopilot):
    """It begins to return NaN on its way along the circle."""
    vehicle = QuickVehicle(autopilot)
    flight = {"guidance": {"kind": "broken"}, "flight": {"maneuvers": ["circle"]}}
    summary = fly(merged(QUICK_FLIGHT, flight), vehicle)
    words = "the commands of guidance (guidance.kind: broken) are NaN or infinite"
    assert summary.result == words
    assert vehicle.state()["mode"] == {"px4": "LOITER", "ardupilot": "BRAKE"}[autopilot]
    assert not vehicle.state()["crashed"]
    for setpoint in vehicle.setpoints:
        assert all(map(isfinite, (*setpoint.rates, setpoint.thrust)))
