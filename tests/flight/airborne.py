"""A mock vehicle that somebody else armed and flew up."""

from tests.flight.fly import QuickVehicle

ARM, TAKEOFF, SET_MODE = 400, 22, 176
CUSTOM_MODE = 1
GUIDED = 4
HEIGHT = 4.0


def ready_to_arm(autopilot):
    """A mock that has booted, in the mode in which a ground station arms it."""
    mock = QuickVehicle(autopilot)
    mock.run(4.0)
    if autopilot == "ardupilot":
        mock.command(SET_MODE, CUSTOM_MODE, GUIDED)
        mock.run(0.2)
    return mock


def in_the_air(autopilot):
    """A mock that a ground station armed and let take off."""
    mock = ready_to_arm(autopilot)
    mock.command(ARM, 1.0)
    mock.run(1.5)
    above_home = HEIGHT if autopilot == "ardupilot" else HEIGHT + mock.settings.home.altitude_m
    mock.command(TAKEOFF, 0, 0, 0, float("nan"), float("nan"), float("nan"), above_home)
    mock.until(lambda state: state["position"][2] < -HEIGHT + 0.3, 30.0)
    mock.run(3.0)
    assert (mock.state()["armed"], mock.state()["crashed"]) == (True, False)
    return mock
