"""Home is set elsewhere in flight, or the ground on which the vehicle stands moves."""

from re import findall

import pytest

from tests.flight.fly import fly, mock_vehicle
from tests.flight.others import When, change_messages

PLACES = ("HOME_POSITION", "LOCAL_POSITION_NED")


@pytest.mark.parametrize(
    ("phase", "higher", "result"),
    [
        ("maneuvers", 10.0, "m below home, below limits.fence_floor_m"),  # it lands, as it says
        ("land", -10.0, "ok"),  # on a roof, 10 m above the new home
    ],
)
def test_home_that_is_set_elsewhere_in_flight_leads_to_the_ground(phase, higher, result):
    moved = 0.0

    def change(message):
        if message.get_type() == "HOME_POSITION":
            message.z -= moved
            message.altitude += round(1e3 * moved)

    def move():
        nonlocal moved
        moved = higher

    with mock_vehicle() as mock:
        change_messages(mock, PLACES, change)
        summary = fly(mock, None, When(phase, move, after=0.3))
        truth = mock.state()
    assert summary.result.endswith(result), summary.events
    assert (truth["armed"], truth["landed"], truth["crashed"]) == (False, True, False)


@pytest.mark.parametrize("jumping", ["HOME_POSITION", "LOCAL_POSITION_NED"])
def test_a_height_that_jumps_in_the_take_off_is_named_and_the_vehicle_lands(jumping):
    """It was taken for a pilot who stopped the climb: the vehicle was left armed in the air."""
    jump = 0.0

    def change(message):
        if message.get_type() == jumping:
            message.z += jump

    def begin_jump():
        nonlocal jump
        jump = -3.0 if jumping == "HOME_POSITION" else 3.0

    with mock_vehicle() as mock:
        change_messages(mock, PLACES, change)
        at = When("takeoff", lambda: mock.at(mock.time + 0.8, begin_jump))
        summary = fly(mock, None, at, flight={"takeoff_height_m": 4.0})
        truth = mock.state()
    climb, height = map(float, findall(r"[\d.]+(?= m\b)", summary.result))
    assert (climb, height) == (pytest.approx(4.0, abs=0.2), pytest.approx(climb - 3.0, abs=0.11))
    assert summary.result == (
        f"after a climb of {climb} m the height above home is {height} m: home or the height "
        "estimate has jumped"
    )
    assert (truth["armed"], truth["landed"], truth["crashed"]) == (False, True, False)


def test_a_home_that_is_set_far_below_in_the_climb_is_named():
    """It was told as a climb to 50 m."""
    moved = 0.0

    def change(message):
        if message.get_type() == "HOME_POSITION":
            message.z += moved

    def move():
        nonlocal moved
        moved = 50.0

    with mock_vehicle() as mock:
        change_messages(mock, PLACES, change)
        summary = fly(mock, None, When("takeoff", move, after=1.0))
        truth = mock.state()
    assert summary.result.startswith("after a climb of "), summary.events
    assert summary.result.endswith("home or the height estimate has jumped")
    assert (truth["armed"], truth["landed"], truth["crashed"]) == (False, True, False)


def test_an_estimate_that_jumps_in_the_climb_is_told_at_the_takeover():
    jump = {"kind": "estimator_reset", "position_ned_m": (1.5, 0.0, 0.0)}
    with mock_vehicle() as mock:
        observer = When("takeoff", lambda: mock.inject(jump), after=1.0)
        summary = fly(mock, None, observer, hover={"duration_s": 0.5})
    assert summary.result == "ok", summary.events
    texts = [text for _, text in summary.events]
    assert "before the takeover the estimated position jumped by 1.5 m" in texts


def test_a_vehicle_whose_height_jumps_on_the_ground_is_not_taken_over_there():
    """It was taken for a climb that had ended, and got setpoints with the thrust of a hover."""
    jump = {"kind": "estimator_reset", "position_ned_m": (0.0, 0.0, -2.5)}
    with mock_vehicle(autopilot="ardupilot") as mock:
        summary = fly(mock, None, When("takeoff", lambda: mock.inject(jump)))
        truth = mock.state()
    assert summary.phase == "takeoff"
    assert summary.result == (
        "the height above home is 2.5 m, but the autopilot reports that the vehicle is on the "
        "ground: home or the height estimate has jumped"
    )
    assert mock.setpoints == []
    assert (truth["armed"], truth["position"][2]) == (False, 0.0)


def test_a_take_off_from_a_boat_that_moves_is_flown():
    """As seen from the water, which is where the program sees it from."""
    with mock_vehicle() as mock:

        def change(message):
            if message.get_type() == "LOCAL_POSITION_NED":
                message.x += 2.0 * mock.time
                message.vx += 2.0

        change_messages(mock, PLACES, change)
        summary = fly(mock)
        truth = mock.state()
    assert summary.result == "ok", summary.events
    assert summary.tracking()["position_max_m"] < 0.5
    assert truth["position"][0] < -5.0, "it stood over the water while the boat went on"
    assert (truth["armed"], truth["crashed"]) == (False, False)
