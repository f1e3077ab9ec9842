"""Whole flights on ArduPilot's rules: GUIDED takes off, holds and obeys rates, all in one mode."""

import pytest
import yaml

from companion.mavlink.commands import CommandClient
from tests.flight import tlog
from tests.flight.fly import CONFIGS, fly, mock_vehicle
from tests.flight.others import When

VEHICLE = yaml.safe_load((CONFIGS / "vehicle-ardupilot.yaml").read_text())
MANEUVERS = {
    **VEHICLE,
    "flight": {"maneuvers": ["hover", "steps", "circle"]},
    "hover": {"duration_s": 1.0},
    "steps": {"duration_s": 0.8, "settle_s": 1.5},
    "circle": {"radius_m": 1.5},
}
IN_AIR = 2
GUIDED, BRAKE = 4, 17
ARM, SET_MODE, TAKE_OFF = (400, 1.0), (176, 1.0), (22, 0.0)
REQUESTS = {511, 512}


def commands(summary):
    """(command, first parameter) of all that we commanded, requests for telemetry left out."""
    sent = tlog.messages(summary, "COMMAND_LONG")
    return [(m.command, m.param1) for m in sent if m.command not in REQUESTS]


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    folder = tmp_path_factory.mktemp("ardupilot")
    with mock_vehicle(folder, autopilot="ardupilot", full_rate=True, seed=7) as mock:
        summary = fly(mock, folder / "log", **MANEUVERS)
        assert not mock.state()["crashed"]
    return summary


def test_the_maneuver_is_flown_and_the_vehicle_lands(flown):
    assert flown.result == "ok", flown.events
    assert flown.phase == "disarm"
    modes = [text for _, text in flown.events if text.startswith("mode ")]
    assert modes[-4:] == ["mode GUIDED", "mode GUIDED (body rates)", "mode BRAKE", "mode LAND"]
    assert flown.events[-1][1] == "disarmed"
    assert any("last rates for 1 s (GUID_TIMEOUT)" in text for _, text in flown.events)
    assert commands(flown) == [SET_MODE, ARM, TAKE_OFF, SET_MODE, SET_MODE]
    assert flown.counts.setpoints == flown.counts.samples > 4500


def test_no_setpoint_leaves_before_the_take_off_is_over_nor_after_the_hand_back(flown):
    """The first one would end the climb; and it must not be an idle one of the ground."""
    landed, setpoints, told = None, [], ("SET_ATTITUDE_TARGET", "EXTENDED_SYS_STATE", "HEARTBEAT")
    mode = None
    for message in tlog.messages(flown, *told):
        if message.get_type() == "EXTENDED_SYS_STATE":
            landed = message.landed_state
        elif message.get_type() == "SET_ATTITUDE_TARGET":
            setpoints.append((landed, mode, message.type_mask, message.thrust))
        elif message.get_srcComponent() == 1:
            mode = message.custom_mode
    assert {landed for landed, *_ in setpoints} == {IN_AIR}
    modes = [mode for _, mode, *_ in setpoints]
    assert set(modes) <= {GUIDED, BRAKE}
    assert modes.count(BRAKE) <= 10  # until BRAKE is heard; it obeys none of them
    assert {mask for _, _, mask, _ in setpoints} == {128}
    assert 0.25 < setpoints[0][3] < 0.5


def test_the_response_is_straight_and_the_circle_is_followed(flown):
    """p = 5 through the measured ArduPilot rate response."""
    response = flown.response()
    assert response.time_constant_north_s == pytest.approx(0.30, abs=0.02)
    assert response.time_constant_east_s == pytest.approx(0.30, abs=0.02)
    assert response.cross_axis_max < 0.01
    tracking = flown.tracking()
    assert tracking["position_rms_m"] < 0.4  # of it the way back after each open-loop step
    assert tracking["height_rms_m"] < 0.05


@pytest.mark.parametrize(
    ("parameters", "words"),
    [
        ({"GUID_OPTIONS": 0}, "set GUID_OPTIONS to 8"),
        ({"ATC_ANGLE_BOOST": 1}, "set ATC_ANGLE_BOOST to 0"),
    ],
)
def test_thrust_that_would_be_taken_for_something_else_is_refused_on_the_ground(
    tmp_path, parameters, words
):
    vehicle = {"autopilot": "ardupilot", "full_rate": True, "parameters": parameters}
    with mock_vehicle(tmp_path, **vehicle) as mock:
        summary = fly(mock, tmp_path / "log", link={"attitude_rate_hz": 500.0})
        assert not mock.state()["armed"]
    assert summary.phase == "checks"
    assert words in summary.result
    assert commands(summary) == []
    told = [text for _, text in summary.events]
    assert "ATTITUDE_QUATERNION: asked for 500 Hz, granted 250 Hz" in told


def test_a_pilot_who_takes_over_is_not_fought(tmp_path):
    takeover = {"kind": "pilot_takeover", "mode": "POSCTL", "after_offboard_s": 1.0}
    with mock_vehicle(tmp_path, autopilot="ardupilot", faults=[takeover]) as mock:
        summary = fly(mock, tmp_path / "log")
        state = mock.state()
    assert summary.result == "the pilot or another station took over: mode LOITER"
    assert commands(summary) == [SET_MODE, ARM, TAKE_OFF]
    assert (state["armed"], state["mode"]) == (True, "LOITER")


def test_a_take_off_whose_answer_was_lost_is_not_repeated_once_it_flies(monkeypatch):
    acks, heard, sent = [], CommandClient._on_ack, CommandClient.send

    def hear(client, message):
        if message.command == TAKE_OFF[0]:
            acks.append(message.result)
            if len(acks) == 1:
                return
        heard(client, message)

    def send(client, command, params, timeout_s, retries):
        # It lifts off 2.3 s after its command; repeated before that, it is accepted again.
        longer = 4.0 if command == TAKE_OFF[0] else timeout_s
        return sent(client, command, params, longer, retries)

    monkeypatch.setattr(CommandClient, "_on_ack", hear)
    monkeypatch.setattr(CommandClient, "send", send)
    with mock_vehicle(autopilot="ardupilot") as mock:
        summary = fly(mock, hover={"duration_s": 0.5})
    assert acks == [0]  # MAV_RESULT: accepted
    assert summary.result == "ok", summary.events


def test_a_pilot_who_brakes_in_the_climb_is_not_fought(tmp_path):
    with mock_vehicle(tmp_path, autopilot="ardupilot") as mock:
        observer = When("takeoff", lambda: mock.command(*SET_MODE, BRAKE), after=1.0)
        summary = fly(mock, tmp_path / "log", observer)
        assert mock.state()["mode"] == "BRAKE"
    assert summary.result == "the pilot or another station took over: mode BRAKE"
    assert commands(summary) == [SET_MODE, ARM, TAKE_OFF]


def test_without_telemetry_nothing_is_sent_and_the_autopilot_levels_by_itself(tmp_path):
    """GUID_TIMEOUT ends what the last rates asked for; it stays in GUIDED, and obeys nobody."""
    silence = {"kind": "drop", "direction": "to_companion", "after_offboard_s": 1.6}
    with mock_vehicle(tmp_path, autopilot="ardupilot", faults=[silence]) as mock:
        summary = fly(mock, tmp_path / "log", flight={"maneuvers": ["steps"]})
        left = mock.state()
        state = mock.until(lambda state: state["time"] > left["last_setpoint"] + 5.0)
    assert "no attitude" in summary.result
    assert set(commands(summary)[3:]) <= {SET_MODE}
    assert state["last_setpoint"] == left["last_setpoint"]
    assert (state["armed"], state["mode"], state["crashed"]) == (True, "GUIDED", False)
    assert max(map(abs, state["q"][1:3])) < 0.02


def test_the_step_past_level_is_straight_by_what_attitude_target_tells():
    """The axes of the rates lead the body by up to 8°; without ATTITUDE_TARGET it bends by 0.03."""
    with mock_vehicle(autopilot="ardupilot", full_rate=True, seed=7) as mock:
        summary = fly(
            mock,
            None,
            vehicle=VEHICLE["vehicle"] | {"yaw_frame_lead_ms": 0.0},
            flight={"maneuvers": ["corners"], "takeoff_height_m": 3.0},
            corners={
                "north_coefficient": 0.4,
                "east_coefficient": 0.5,
                "duration_s": 1.2,
                "settle_s": 0.5,
            },
            limits={"max_tilt_deg": 45, "max_tilt_rate_deg_s": 400},
        )
    assert summary.result == "ok", summary.events
    assert summary.response().cross_axis_max < 0.008
