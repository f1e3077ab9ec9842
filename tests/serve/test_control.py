"""Control by clients on both mock vehicles, in vehicle time."""

import asyncio
import json
import math

import pytest
from pymavlink import mavutil
from pymavlink.dialects.v20 import ardupilotmega as dialect

from companion.config.files import load
from companion.flight.changes import ChangeRefusedError
from companion.recording.flight_record import read_flight
from companion.replay.replay import Replay
from tests.serve.offboard_scene import on_circle
from tests.serve.virtual import (
    ALL,
    POSITION,
    VELOCITY,
    MemoryClient,
    airborne,
    begin_control,
    mock,
    place,
    served,
    stream,
)

BOTH = pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
REJECTED = dialect.MAV_RESULT_TEMPORARILY_REJECTED


def fly(autopilot, scene, directory=None):
    """Run a scene with an airborne vehicle and a connected script."""
    vehicle = mock(autopilot)

    async def whole(session):
        ground = await airborne(session, vehicle, autopilot)
        script = MemoryClient().connect(session)
        await scene(vehicle, session, script, ground)

    served(vehicle, autopilot, whole, directory=directory)


def sent_rates(tlog):
    log = mavutil.mavlink_connection(str(tlog))
    return list(iter(lambda: log.recv_match(type="SET_ATTITUDE_TARGET"), None))


def velocity(session):
    return session.flights._vehicle.link.state.position.velocity_ned


def heading(vehicle):
    w, x, y, z = vehicle.state()["q"]
    return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


@BOTH
def test_a_streamed_circle_is_flown_as_it_is(autopilot):
    """5 m at 5 m/s, 50 Hz: within 0.1 m RMS of the setpoints, by the vehicle's own estimate."""

    async def scene(_, session, script, __):
        start = place(session)
        await begin_control(session, script, autopilot, lambda _: script.local(ALL, start))
        await stream(0.5, lambda _: script.local(ALL, start))
        errors = []

        def send(time):
            script.local(ALL, *on_circle(time, start))
            flight = session.flights.current_flight
            error = None if flight is None else flight.tracking_error
            errors.extend([error] if time > 4.0 else [])

        await stream(7.0, send)
        assert math.sqrt(sum(error**2 for error in errors) / len(errors)) < 0.10
        assert {each.name for each in script.of("NAMED_VALUE_FLOAT")} == {"trk_err_m", "answer_ms"}

    fly(autopilot, scene)


@BOTH
def test_positions_velocities_and_attitudes_are_flown(autopilot):
    async def scene(vehicle, session, script, _):
        start = place(session)
        hover = {"px4": 0.49, "ardupilot": 0.364}[autopilot]
        await begin_control(session, script, autopilot, lambda _: script.local(POSITION, start))
        there = (start[0] + 4.0, start[1] - 3.0, start[2] - 2.0)
        await stream(6.0, lambda _: script.local(POSITION & ~1024, there, yaw=1.0), 0.1)
        assert math.dist(place(session), there) < 0.2
        assert heading(vehicle) == pytest.approx(1.0, abs=0.1)
        forward = (1.5, 0.0, 0.0)
        await stream(3.0, lambda _: script.local(VELOCITY, velocity=forward, frame=8), 0.05)
        north, east, down = velocity(session)
        assert (north, east) == pytest.approx((1.5 * math.cos(1.0), 1.5 * math.sin(1.0)), abs=0.25)
        assert abs(down) < 0.15
        to_us = 1, 191
        stop = lambda _: script.local(VELOCITY, velocity=(0, 0, 0), target=to_us)  # noqa: E731
        await stream(3.0, stop, 0.05)
        assert math.hypot(*velocity(session)) < 0.15
        tilt = math.radians(6.0)
        q = (math.cos(0.5 * tilt), math.sin(0.5 * tilt), 0.0, 0.0)  # a roll to the right, heading 0
        height = place(session)[2]
        await stream(1.5, lambda _: script.attitude(7, q, hover), 0.02)
        assert 2.0 * math.asin(math.hypot(*vehicle.state()["q"][1:3])) == pytest.approx(
            tilt, abs=0.03
        )
        assert abs(place(session)[2] - height) < 1.5
        await stream(0.7, lambda _: script.local(POSITION, there), 0.1)
        assert session.flights.in_control, script.texts()

    fly(autopilot, scene)


@BOTH
def test_a_station_wins_over_a_client_and_its_stream_is_not_obeyed_any_more(autopilot):
    async def scene(vehicle, session, script, ground):
        begin = place(session)
        await begin_control(session, script, autopilot, lambda _: script.local(ALL, begin))
        land = {"px4": (176, 1, 4, 6), "ardupilot": (176, 1, 9)}[autopilot]
        slower, flat = {"limits": {"max_climb_m_s": 1.0}}, {"limits": {"max_tilt_deg": 16.0}}
        for values, told in ((slower, "while a client is in control"), (flat, "serve.max_accel")):
            with pytest.raises(ChangeRefusedError, match=told):
                session.changes.change(values, "a test")
        script.command(176, 1, 99)  # a mode that does not exist; long before the station's mode
        await stream(2.5, lambda _: script.local(ALL, begin))
        assert session.flights.in_control
        ground.command(192, -1, 1)  # DO_REPOSITION
        await stream(0.5, lambda _: script.local(ALL, begin))
        if autopilot == "ardupilot":  # it would fly there in the mode of our setpoints
            assert ground.of("COMMAND_ACK")[-1].result == REJECTED
            assert "is in control; change the mode first" in " ".join(ground.texts())
            assert session.flights.in_control
            acks = len(ground.of("COMMAND_ACK"))
            ground.send(dialect.MAVLink_mission_item_int_message(1, 1, 0, 6, 16, 2, 1, *[0] * 7))
            ground.send(dialect.MAVLink_request_data_stream_message(1, 1, 0, 1, 1))
            await stream(0.5, lambda _: script.local(ALL, begin))
            assert [ack.type for ack in ground.of("MISSION_ACK")] == [dialect.MAV_MISSION_DENIED]
            assert len(ground.of("COMMAND_ACK")) == acks  # neither of them is a command
        ground.command(*land)
        await stream(1.5, lambda _: script.local(ALL, begin))
        session.changes.change(slower, "a test")  # nobody is in control
        assert vehicle.state()["mode"] == {"px4": "LAND", "ardupilot": "LAND"}[autopilot]
        assert not session.flights.in_control
        count = len(vehicle.setpoints)
        await stream(1.0, lambda _: script.local(ALL, begin))
        assert len(vehicle.setpoints) == count
        assert any("took over" in text for text in script.texts())

    fly(autopilot, scene)


def test_a_geofence_that_acts_as_the_client_releases_is_not_told_as_its_release():
    text = dialect.MAVLink_statustext_message(5, b"Circle fence breached")
    breached = bytes(text.pack(dialect.MAVLink(None, 1, 1)))

    async def scene(vehicle, session, script, ground):
        begin = place(session)
        await begin_control(session, script, "ardupilot", lambda _: script.local(ALL, begin))
        script.command(176, 1, 5)  # LOITER
        vehicle.to_companion = lambda data: [data, breached]
        vehicle.command(176, 1, 6)  # RTL
        await stream(1.0, lambda _: script.local(ALL, begin))
        told = " ".join(script.texts())
        assert "failsafe took over" in told, told
        assert "released by the client" not in told

    fly("ardupilot", scene)


def test_px4_is_asked_for_offboard_by_the_rules_of_px4_and_the_flight_is_recorded(tmp_path):
    async def scene(vehicle, session, script, ground):
        assert await script.offboard() == REJECTED, "no stream"
        assert "setpoints first" in " ".join(script.texts())
        assert not list(tmp_path.iterdir())
        begin = place(session)
        await begin_control(session, script, "px4", lambda _: script.local(ALL, begin))
        assert await script.offboard() == dialect.MAV_RESULT_ACCEPTED, "again"
        assert await ground.offboard() == REJECTED, "of another station"
        script.command(511, dialect.MAVLINK_MSG_ID_ATTITUDE_QUATERNION, 1e6)
        await stream(2.0, lambda _: script.local(ALL, begin))
        assert session.flights.in_control, "its telemetry is not taken away"
        script.command(176, 1, 4, 3)  # hold, as MAVSDK's offboard.stop()
        await stream(1.0, lambda _: script.local(ALL, begin))
        assert vehicle.state()["mode"] == "LOITER"
        assert not session.flights.in_control
        assert any("released by the client" in text for text in script.texts())
        (folder,) = tmp_path.iterdir()
        summary = json.loads((folder / "summary.json").read_text())
        assert [phase["name"] for phase in summary["phases"]][:2] == ["connect", "checks"]
        assert summary["result"] == "ok", "the client ended it as it wished"
        assert any("commanded mode AUTO.LOITER" in event["text"] for event in summary["events"]), (
            summary["events"]
        )
        assert summary["link"]["frames"] < session.flights._vehicle.link.stats.frames, (
            "of this flight"
        )
        assert summary["tracking"]["position_rms_m"] < 0.1
        assert load(folder / "config.yaml").limits.max_tilt_deg == 45.0
        sent = sent_rates(folder / "flight.tlog")
        assert len(sent) == summary["setpoints"]
        replay = Replay(read_flight(folder), load(folder / "config.yaml"))
        assert replay.follows_record
        samples = replay.run()
        assert sum(each.replayed_setpoint is not None for each in samples) == summary["setpoints"]
        assert [each for each in samples if not each.is_same] == []

    fly("px4", scene, directory=tmp_path)


def test_a_single_setpoint_in_guided_gives_no_control():
    async def scene(vehicle, session, script, _):
        script.local(POSITION, (20.0, 0.0, -5.0))
        await asyncio.sleep(2.0)
        assert not session.flights.in_control
        assert vehicle.state()["mode"] == "GUIDED"

    fly("ardupilot", scene)


@pytest.mark.parametrize(
    ("modes", "told"),
    [
        ({"script": 9}, "control was not given to program (245/190): program (245/190) commanded"),
        ({"script": 4, "station": 9}, "control was not given to program (245/190): the pilot or"),
    ],
    ids=["the client lands", "a station lands"],
)
def test_a_takeover_that_another_mode_ends_is_told_with_who_commanded_it(modes, told):
    """It was told as "ok"; and a client that commands GUIDED again gives up nothing."""

    async def scene(vehicle, session, script, ground):
        begin = place(session)
        hold = lambda _: script.local(ALL, begin)  # noqa: E731
        while session.flights.current_flight is None:
            await stream(0.1, hold)
        for name, mode in modes.items():
            {"script": script, "station": ground}[name].command(176, 1, mode)
            await stream(0.1, hold)
        await stream(1.5, hold)
        assert vehicle.state()["mode"] == "LAND"
        assert told in " ".join(script.texts())

    fly("ardupilot", scene)


def test_on_the_ground_ardupilot_s_setpoints_are_refused_in_words():
    vehicle = mock("ardupilot")

    async def scene(session):
        script = MemoryClient().connect(session)
        await asyncio.sleep(6.0)
        script.command(176, 1, 4)
        await stream(1.0, lambda _: script.local(POSITION, (0.0, 0.0, -5.0)))
        assert "take off first" in " ".join(script.texts())
        assert not vehicle.setpoints

    served(vehicle, "ardupilot", scene)


def test_px4_takes_off_for_a_client_that_asks_for_offboard_on_the_ground(tmp_path):
    """As MAVSDK: its stream stops 3 s after it has asked, and goes on when it is answered."""
    vehicle = mock("px4")
    up = (0.0, 0.0, -5.0)

    async def scene(session):
        script = MemoryClient().connect(session)
        await asyncio.sleep(3.0)
        await stream(0.5, lambda _: script.local(POSITION, up))
        assert await script.offboard() == REJECTED
        assert "arm it first" in " ".join(script.texts())
        script.command(400, 1)
        await stream(1.5, lambda _: script.local(POSITION, (0.0, 0.0, 0.0)))
        assert await script.offboard() == REJECTED
        assert "command a height" in " ".join(script.texts())
        assert not vehicle.setpoints
        await stream(0.3, lambda _: script.local(POSITION, up))
        asked = asyncio.ensure_future(script.offboard())
        await stream(3.0, lambda _: script.local(POSITION, up))
        assert await asked == dialect.MAV_RESULT_ACCEPTED
        assert vehicle.state()["mode"] == "OFFBOARD"
        assert -vehicle.state()["position"][2] > 1.5, "no setpoint of ours on the ground"
        await asyncio.sleep(1.0)
        assert session.flights.in_control, "held until it goes on"
        await stream(5.0, lambda _: script.local(POSITION, up), 0.1)
        assert math.dist(vehicle.state()["position"], up) < 0.3

    served(vehicle, "px4", scene, directory=tmp_path)
    assert min(setpoint.thrust for setpoint in vehicle.setpoints) > 0.1, "none is idle"
    (folder,) = tmp_path.iterdir()
    phases = [one["name"] for one in json.loads((folder / "summary.json").read_text())["phases"]]
    assert phases == ["connect", "checks", "takeoff", "offboard", "control", "hand back"]


def test_what_stops_the_takeoff_for_a_client_ends_it():
    """A station that commands hold in the climb wins; a vehicle disarmed before it stays down."""
    vehicle = mock("px4")

    async def scene(session):
        script = MemoryClient().connect(session)
        station = MemoryClient("station", (255, 190)).connect(session)
        await asyncio.sleep(3.0)
        hold = lambda _: script.local(POSITION, (0.0, 0.0, -8.0))  # noqa: E731
        for stop, height in (((400, 0), 0.0), ((176, 1, 4, 3), 0.8)):
            script.command(400, 1)
            await stream(0.2, hold)
            asked = asyncio.ensure_future(script.offboard())
            await stream(1.5, hold)
            while -vehicle.state()["position"][2] < height:
                await stream(0.1, hold)
            station.command(*stop)
            while not asked.done():
                await stream(0.1, hold)
            assert asked.result() == REJECTED
            await stream(1.0, hold)
            assert not session.flights.in_control
        assert vehicle.state()["mode"] == "LOITER"

    served(vehicle, "px4", scene)
    assert not vehicle.setpoints


def test_setpoints_for_another_vehicle_behind_a_client_are_passed_to_it():
    vehicle = mock("px4")

    async def scene(session):
        script = MemoryClient().connect(session)
        other = MemoryClient("other vehicle", (2, 1)).connect(session)
        other.send(dialect.MAVLink_heartbeat_message(2, 12, 0, 0, 4, 3))
        script.local(ALL, (1.0, 2.0, -3.0), target=(2, 1))
        await other.hears("SET_POSITION_TARGET_LOCAL_NED")
        assert not script.texts()

    served(vehicle, "px4", scene)


def test_without_control_setpoints_are_passed_on_as_everything_else():
    vehicle = mock("px4")

    async def scene(session):
        script = MemoryClient().connect(session)
        await asyncio.sleep(8.0)
        await stream(1.5, lambda _: script.local(POSITION, (0.0, 0.0, -5.0)))
        assert await script.offboard() == dialect.MAV_RESULT_ACCEPTED
        await script.hears("HEARTBEAT")
        assert vehicle.state()["setpoints"] > 50

    served(vehicle, "px4", scene, control=False)
