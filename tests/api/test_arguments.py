"""What a program passes to a vehicle: it is copied, or refused in a sentence."""

import asyncio
from math import dist, hypot, inf, nan

import numpy as np
import pytest

from companion import Reference
from companion.api.commanded import checked_copy
from companion.attitude import BodyRates, Coefficients
from companion.files.yaml_file import ConfigError
from companion.guidance.reference import ThrustCommand, TiltCommand
from companion.guidance.trajectory import Hover, Sample
from tests.api.test_flying import flown
from tests.flight.fly import QuickVehicle

REST = (0.0, 0.0, 0.0)


class Own:
    """A trajectory of 4 s along a straight line, with what a test makes wrong."""

    name = "mine"
    holds_heading = True
    duration = 4.0

    def at(self, time):
        return Sample(REST, REST, REST, REST, 0.0, 0.0)

    def check_times(self):
        return [0.0, 2.0, 4.0]


class Elsewhere(Own):
    def at(self, time):
        return Sample((3.0, 0.0, 0.0), REST, REST, REST, 0.0, 0.0)


class NoEnd(Own):
    duration = nan


async def reuses_arrays(vehicle):
    """How far a program that writes into the arrays of its references is off, m."""
    off, start = [], vehicle.state.position_ned
    place, still = np.array(start), np.zeros(3)
    async with vehicle.control() as control:
        for _ in range(30):
            control.follow(Reference(place, still, still), jerk_ned=still)
            place += (5.0, 0.0, 0.0)  # the next place, which is not commanded yet
            still += 5.0
            await asyncio.sleep(0.06)
            off.append(dist(vehicle.state.position_ned, start))
            place[:], still[:] = start, 0.0
    return off


async def is_refused(vehicle):
    """What each call with a wrong argument says, and how far it was moved, m."""
    refused = {}
    north, east, down = vehicle.state.position_ned
    there = (north + 1.0, east, down)
    calls = {
        "two numbers": lambda: vehicle.go_to((north, east)),
        "a word": lambda: vehicle.go_to("abc"),
        "speed": lambda: vehicle.go_to(there, speed=nan),
        "heading": lambda: vehicle.go_to(there, heading="north"),
        "degrees": lambda: vehicle.go_to(there, heading=90.0),
        "forever": lambda: vehicle.hold(nan),
        "a number": lambda: vehicle.follow(5),
        "elsewhere": lambda: vehicle.follow(Elsewhere()),
        "no end": lambda: vehicle.follow(NoEnd()),
    }
    for name, call in calls.items():
        try:
            await call()
        except (ConfigError, TypeError, ValueError) as error:
            refused[name] = str(error)
    await vehicle.follow(Own())
    return {**refused, "moved": dist(vehicle.state.position_ned, (north, east, down))}


async def states_for_nan(vehicle):
    """What the states of a time that is no number say."""
    async with vehicle.control() as control:
        control.accelerate(REST)
        try:
            async for _ in control.states(seconds=nan):
                pass
        except ValueError as error:
            return str(error)
    return ""


async def stays(vehicle):
    """Where and how the vehicle is after it was sent where it was: distance, m, heading, rad."""
    place = vehicle.state.position_ned
    await vehicle.go_to(place)
    await vehicle.go_to(place)
    await vehicle.go_to(place, heading=1.0)
    return dist(vehicle.state.position_ned, place), vehicle.state.heading


@pytest.fixture(scope="module")
def seen():
    """What each of the programs above saw, all in one flight."""
    found = {}

    async def program(vehicle):
        await vehicle.take_off()
        for part in (reuses_arrays, is_refused, states_for_nan, stays):
            found[part] = await part(vehicle)
        await vehicle.land()

    summary, _ = flown(program, QuickVehicle())
    assert summary.result == "ok"
    return found


def test_references_are_copied_so_that_a_program_may_reuse_its_arrays(seen):
    """A program wrote into the array that it had passed, and guidance flew what stood there."""
    assert max(seen[reuses_arrays]) < 0.2


def test_a_copied_reference_holds_plain_numbers():
    arrays = Reference(np.ones(3), [1, 2, 3], np.zeros(3, np.float32), np.float64(1.0))
    for reference in (arrays, arrays._replace(horizontal=TiltCommand(np.zeros(2)))):
        made = checked_copy(reference)
        assert made.position_ned == (1.0, 1.0, 1.0)
        assert made.velocity_ned == (1.0, 2.0, 3.0)
        assert type(made.heading) is type(made.acceleration_ned[0]) is float
    tilted = checked_copy(arrays._replace(horizontal=TiltCommand((0, 0), trimmed=True))).horizontal
    assert isinstance(tilted.coefficients, Coefficients)
    assert tilted.trimmed


@pytest.mark.parametrize(
    "changes", [{"horizontal": Coefficients(0.0, 0.0)}, {"vertical": 0.5}, {"vertical": None}]
)
def test_a_command_of_another_type_is_refused_with_the_types_that_are_meant(changes):
    with pytest.raises(TypeError, match=rf"^{next(iter(changes))} must be a \w+Mode"):
        checked_copy(Reference(REST)._replace(**changes))


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("position_ned", (0.0, 0.0)),
        ("velocity_ned", "abc"),
        ("acceleration_ned", None),
        ("heading", "north"),
        ("heading_rate", nan),
    ],
)
def test_what_is_wrong_in_a_reference_is_named(field, value):
    with pytest.raises(ValueError, match=f"{field} must be"):
        checked_copy(Reference(REST)._replace(**{field: value}))


@pytest.mark.parametrize(
    ("wrong", "field", "value"),
    [
        ("body_rates", "horizontal", BodyRates(0.0, nan, 0.0)),
        ("east", "horizontal", TiltCommand(Coefficients(0.0, inf))),
        ("thrust", "vertical", ThrustCommand(inf)),
    ],
)
def test_what_is_wrong_in_a_command_is_named(wrong, field, value):
    with pytest.raises(ValueError, match=f"{wrong} must be"):
        checked_copy(Reference(REST)._replace(**{field: value}))


@pytest.mark.parametrize("what", [None, REST, "hover"])
def test_a_reference_is_a_reference(what):
    with pytest.raises(TypeError, match=r"a reference must be a companion\.Reference"):
        checked_copy(what)


def test_arguments_that_cannot_be_flown_are_refused_and_the_vehicle_holds_on(seen):
    refused = dict(seen[is_refused])
    assert refused.pop("moved") < 0.3
    words = {
        "two numbers": "position_ned must be three finite numbers",
        "a word": "position_ned must be three finite numbers",
        "speed": "speed must be a finite number, not nan",
        "heading": "heading must be a finite number, not 'north'",
        "degrees": "heading is in rad, and 90 rad are more than two turns",
        "forever": "seconds must be a finite number",
        "a number": "int is no trajectory: it has no `name`",
        "elsewhere": "mine: it begins 3.00 m from (0, 0, 0)",
        "no end": "mine: its duration must be a time of 0 s or more, not nan",
    }
    assert refused.keys() == words.keys()
    for name, text in words.items():
        assert text in refused[name]


def test_states_for_a_time_that_is_no_number_are_refused(seen):
    """The loop ended before it began, without a word."""
    assert "seconds must be a number" in seen[states_for_nan]


def test_to_go_where_the_vehicle_is_turns_it_or_does_nothing(seen):
    off, heading = seen[stays]
    assert off < 0.2
    assert heading == pytest.approx(1.0, abs=0.05)


def test_a_hover_may_face_a_heading():
    assert not Hover(1.0, heading=0.5).holds_heading
    assert Hover(1.0, heading=0.5).at(0.5).heading == 0.5
    assert hypot(*Hover(1.0).at(0.5).position) == 0.0
