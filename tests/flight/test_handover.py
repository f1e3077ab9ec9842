"""`flight.take_over`: the pilot flies the vehicle up, hands over in the air, and gets it back."""

import pytest

import companion
from companion import testing
from companion.cli.command_line import parse
from companion.cli.flying import with_options
from companion.config import Config
from companion.config.files import changed, load, shipped
from companion.files.yaml_file import ConfigError
from companion.testing import connect, run
from tests.flight.airborne import ARM, CUSTOM_MODE, GUIDED, HEIGHT, SET_MODE, TAKEOFF, in_the_air
from tests.flight.fly import QuickVehicle, fly, quick_flight
from tests.flight.others import When

BOTH = pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
HELD = ("LOITER", "BRAKE")


def handed_over(autopilot, **flight):
    """The configuration of a flight that begins in the air."""
    keys = {"take_over": True, "arm": False, "takeoff_height_m": HEIGHT, **flight}
    return quick_flight(autopilot, {"flight": keys, "hover": {"duration_s": 1.0}})


def hold(mock):
    """Let a station switch to the mode in which the pilot hands over."""
    mode = (4, 3) if mock.autopilot == "px4" else (GUIDED,)
    mock.command(SET_MODE, CUSTOM_MODE, *mode)


def obeyed(mock):
    return mock.state()["mode"] in ("OFFBOARD", "GUIDED") and bool(mock.setpoints)


@BOTH
def test_a_vehicle_that_its_pilot_holds_is_taken_over_flown_and_given_back(autopilot):
    mock = in_the_air(autopilot)
    changes = {"circle": {"radius_m": 1.5}}
    config = changed(handed_over(autopilot, maneuvers=["hover", "circle"]), changes, "test")
    summary = testing.fly(config, mock)
    state = mock.state()
    assert summary.result == "ok", summary.events
    assert [part.name for part in summary.maneuvers()] == ["hover", "circle"]
    assert summary.tracking()["position_rms_m"] < 0.15
    assert (state["mode"] in HELD, state["armed"], state["landed"]) == (True, True, False)


@BOTH
def test_it_waits_on_the_ground_until_the_pilot_has_flown_up_and_switched_to_hold(autopilot):
    """While the pilot flies by position, no setpoint is sent."""
    mock = QuickVehicle(autopilot)
    mock.run(4.0)
    sent_before = []

    def take_off():
        above = HEIGHT if autopilot == "ardupilot" else HEIGHT + mock.settings.home.altitude_m
        nan = float("nan")
        mock.command(TAKEOFF, 0, 0, 0, nan, nan, nan, above + 1.0)

    def arm():
        hold(mock)
        mock.command(ARM, 1.0)

    def give_over():
        sent_before.append(len(mock.setpoints))
        hold(mock)

    def climbing(height):
        return lambda: mock.state()["position"][2] < -height

    mock.at(10.0, arm)
    mock.at(11.0, take_off)
    mock.when(climbing(3.0), mock.take_over)
    mock.when(climbing(3.0), lambda: mock.at(mock.time + 4.0, give_over))
    summary = testing.fly(handed_over(autopilot, takeoff_height_m=2.0), mock)
    assert summary.result == "ok", summary.events
    assert sent_before == [0]
    assert "maneuver: hover" in [text for _, text in summary.events]


@BOTH
def test_a_vehicle_held_too_low_is_not_taken_over(autopilot):
    mock = in_the_air(autopilot)
    config = handed_over(autopilot, takeoff_height_m=8.0, arming_timeout_s=3.0)
    summary = testing.fly(config, mock)
    assert summary.result.startswith(
        "waited 3 s for the pilot to hand over in the air: a height of 7.5 m "
    ), summary.result
    assert not mock.setpoints
    assert mock.state()["mode"] in ("LOITER", "GUIDED")


@BOTH
def test_a_vehicle_refused_before_its_takeover_is_left_in_the_mode_of_its_pilot(autopilot):
    """Nothing was taken yet, so nothing is commanded."""
    mock = in_the_air(autopilot)
    mode = mock.state()["mode"]
    wrong_thrust = {"thrust": {"hover_thrust": 0.2, "correction_limit": 0.1}}
    summary = testing.fly(changed(handed_over(autopilot), wrong_thrust, "test"), mock)
    assert (summary.phase, summary.events[-1][1]) == ("offboard", "leaving the vehicle as it is")
    assert "hover" in summary.result
    mock.run(1.0)  # a command may be on its way
    assert (mock.state()["mode"], mock.setpoints) == (mode, [])


@BOTH
def test_the_pilot_takes_it_back_at_any_time(autopilot):
    mock = in_the_air(autopilot)
    mock.when(lambda: obeyed(mock), lambda: mock.at(mock.time + 1.5, mock.take_over))
    summary = testing.fly(handed_over(autopilot), mock)
    assert "the pilot or another station took over" in summary.result
    mode, count = mock.state()["mode"], len(mock.setpoints)
    mock.run(2.0)
    assert (mock.state()["mode"], len(mock.setpoints)) == (mode, count)
    assert mode in ("POSCTL", "LOITER")


def test_a_vehicle_that_stands_armed_is_refused():
    mock = QuickVehicle()
    mock.run(4.0)
    mock.command(ARM, 1.0)
    mock.run(1.5)
    summary = testing.fly(handed_over("px4"), mock)
    assert "armed" in summary.result
    assert not mock.setpoints


def test_the_program_does_not_arm_what_the_pilot_hands_over():
    with pytest.raises(ConfigError, match=r"flight\.take_over and flight\.arm \(--arm\) exclude"):
        changed(Config(), {"flight": {"arm": True, "take_over": True}}, "test")


@pytest.mark.parametrize("option", ["--arm", "--take-over"])
def test_an_option_replaces_the_other_one_of_the_file(option, tmp_path):
    """The shipped configuration of the mock vehicle arms."""
    file = tmp_path / "own.yaml"
    file.write_text(f"flight: {{take_over: {str(option == '--arm').lower()}}}\n", "utf-8")
    options = parse(["fly", "--config", str(file), option])
    path = shipped("mock-px4.yaml") if option == "--take-over" else file
    flown = with_options(load(path), options).flight
    assert (flown.arm, flown.take_over) == (option == "--arm", option == "--take-over")


@BOTH
def test_a_program_takes_over_what_another_one_left_in_the_air(autopilot):
    mock = in_the_air(autopilot)
    moved = []

    async def main():
        async with connect(handed_over(autopilot, take_over=False), mock) as vehicle:
            with pytest.raises(companion.FlightEnded, match="the vehicle flies already"):
                await vehicle.take_off()
            with pytest.raises(companion.FlightEnded, match="take off first, or take over"):
                await vehicle.hold(1.0)
            await vehicle.take_over()
            with pytest.raises(companion.FlightEnded, match="under our control already"):
                await vehicle.take_over()
            north, east, down = vehicle.state.position_ned
            await vehicle.go_to((north + 2.0, east, down))
            moved.append(vehicle.state.position_ned[0] - north)
            await vehicle.land()
        return vehicle.summary

    summary = run(mock, main())
    assert summary.result == "ok", summary.events
    assert moved == [pytest.approx(2.0, abs=0.2)]
    assert mock.state()["landed"]


def test_after_an_offboard_loss_it_waits_until_the_pilot_commands_hold():
    """A killed or unheard program left it in the failsafe's hold: the takeover was refused."""
    mock = QuickVehicle("px4", parameters={"COM_OBL_RC_ACT": 5})
    lost = {"kind": "drop", "direction": "both", "duration_s": 11.0}
    lose = When("maneuvers", lambda: mock.inject(lost), after=1.0)
    fly(mock, None, lose, hover={"duration_s": 9.0})
    state = mock.state()
    assert (state["mode"], state["intended_mode"]) == ("LOITER", "OFFBOARD")
    waits = []

    class Pilot(When):
        def waiting(self, name, waiting_for, elapsed, timeout):
            waits.append(waiting_for)
            super().waiting(name, waiting_for, elapsed, timeout)

    pilot = Pilot("hand over", lambda: hold(mock), after=2.0)
    summary = testing.fly(handed_over("px4", takeoff_height_m=2.0), mock, None, pilot)
    assert summary.result == "ok", summary.events
    wait = "the pilot to switch to AUTO.LOITER, now AUTO.LOITER by the autopilot's failsafe"
    assert wait in waits
