"""Attitude, position or velocity repeats itself under new time stamps, as from a broken relay."""

from math import acos, cos, degrees, sin
from types import SimpleNamespace

import pytest

from companion.attitude import BodyRates
from companion.safety.frozen_telemetry import FrozenTelemetry
from tests.flight.fly import fly, mock_vehicle
from tests.flight.others import When, change_messages

ATTITUDE = ("ATTITUDE_QUATERNION", ("q1", "q2", "q3", "q4"))
HORIZONTAL = ("LOCAL_POSITION_NED", ("x", "y"))
HEIGHT = ("LOCAL_POSITION_NED", ("z",))
VELOCITY = ("LOCAL_POSITION_NED", ("vx", "vy", "vz"))
POSITION = ("LOCAL_POSITION_NED", ("x", "y", "z", "vx", "vy", "vz"))


def freeze(mock, name, fields):
    """The first numbers of a message are repeated for ever; the time stamps go on."""
    kept = {}

    def repeat(message):
        for field in fields:
            setattr(message, field, kept.setdefault(field, getattr(message, field)))

    change_messages(mock, {name}, repeat)


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
@pytest.mark.parametrize(
    ("name", "fields", "told"),
    [
        (*ATTITUDE, "repeats one attitude, although setpoints turn the vehicle"),
        (*POSITION, "repeats one position, although it reports a speed"),
        (*HORIZONTAL, "repeats one position, although it reports a speed"),
        (*HEIGHT, "repeats one position, although it reports a speed"),
        (*VELOCITY, "repeats one velocity, but its positions show another one"),
    ],
)
def test_a_vehicle_is_not_flown_by_telemetry_that_stands_still(autopilot, name, fields, told):
    """It flew on for ten seconds: 15 to 25 m away, or upside down into the ground."""
    tilts = []

    def look():
        state = mock.state()
        _, x, y, _ = state["q"]
        if not state["on_ground"]:
            tilts.append(degrees(acos(1.0 - 2.0 * (x * x + y * y))))

    wind = {"speed_m_s": 3.0, "gust_m_s": 1.0}
    with mock_vehicle(autopilot=autopilot, wind=wind) as mock:
        mock.after_step.append(look)
        observer = When("maneuvers", lambda: freeze(mock, name, fields), after=1.0)
        summary = fly(
            mock, None, observer, flight={"takeoff_height_m": 6.0}, hover={"duration_s": 10.0}
        )
        mock.run(5.0)
        truth = mock.state()
    assert summary.result == f"frozen telemetry: {name} {told}"
    assert (truth["mode"] in ("LOITER", "BRAKE"), truth["crashed"]) == (True, False)
    assert max(tilts) < 45.0


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
def test_a_simulated_vehicle_at_perfect_rest_is_not_frozen(autopilot):
    noises = ("attitude_noise_deg", "rate_noise_rad_s", "position_noise_m", "velocity_noise_m_s")
    quiet = {**dict.fromkeys(noises, 0.0), "ekf": "none"}
    with mock_vehicle(autopilot=autopilot, sensors=quiet) as mock:
        summary = fly(mock, hover={"duration_s": 8.0})
    assert summary.result == "ok", summary.events


def looks(times, attitude=lambda t: 1.0, rate=0.0, place=lambda t: t, speed=lambda t: 1.0, axis=0):
    """What is found frozen in looks at these times, each at new messages."""
    frozen = FrozenTelemetry()
    for t in times:
        sample = SimpleNamespace(received=t, q=(attitude(t), 0.0, 0.0, 0.0))
        moving = [(0.0, 0.0), (0.0, 0.0), (0.0, 0.0)]
        moving[axis] = place(t), speed(t)
        position_ned, velocity_ned = zip(*moving, strict=True)
        position = SimpleNamespace(received=t, position_ned=position_ned, velocity_ned=velocity_ned)
        found = frozen.find_frozen(t, sample, BodyRates(rate, 0.0, 0.0), position)
        if found:
            return found
    return None


TIMES = [0.02 * step for step in range(100)]


def test_what_contradicts_itself_is_frozen():
    assert "attitude" in looks(TIMES, rate=0.1)
    assert "one position" in looks(TIMES, place=lambda t: 3.0)
    hovers = looks(TIMES, place=lambda t: 3.0, speed=lambda t: 0.05 * sin(30.0 * t))
    assert "one position" in hovers, "to and fro: each way changes the numbers of a true position"


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_each_axis_of_position_or_velocity_may_stand_still_alone(axis):
    """Frozen x and y, z, or velocity alone were flown by: only all six numbers at once counted."""
    place, speed = (lambda t: 0.1 * sin(3.0 * t)), (lambda t: 0.3 * cos(3.0 * t))
    assert looks(TIMES, place=place, speed=speed, axis=axis) is None
    assert "one position" in looks(TIMES, place=lambda t: 0.0, speed=speed, axis=axis)
    assert "one velocity" in looks(TIMES, place=place, speed=lambda t: 0.3, axis=axis)


def test_what_only_repeats_itself_is_not_frozen():
    assert looks(TIMES) is None, "no turn is commanded"
    stands = looks(TIMES, place=lambda t: 3.0, speed=lambda t: 0.0)
    assert stands is None, "it reports that it stands"
    reset = looks(TIMES, place=lambda t: 3.0 if t < 1.0 else 3.5, speed=lambda t: 0.0)
    assert reset is None, "a simulated vehicle at rest whose estimate jumps"
    at_5_hz = looks(TIMES, attitude=lambda t: t // 0.1, rate=0.4, place=lambda t: t // 0.2)
    assert at_5_hz is None, "estimates made at 5 and 10 Hz, sent at 50 Hz"
