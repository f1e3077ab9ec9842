"""`serve` in memory and in lockstep: equal programs give equal flights, to the bit."""

import json
import math

import pytest
from pymavlink import mavutil

from companion.config.files import load
from companion.recording.flight_record import read_flight
from companion.replay.replay import Replay
from tests.serve.virtual import (
    ALL,
    POSITION,
    MemoryClient,
    airborne,
    begin_control,
    mock,
    place,
    served,
    stream,
)

BEFORE = {"guidance": {"position_weight_per_s4": 120.0}}
IN_FLIGHT = {"planner": {"gain_per_s": 4.0}, "guidance": {"position_weight_per_s4": 60.0}}


def flown(folder):
    """A flight with a change of gains before it, one in it and its undoing; the setpoints."""
    vehicle = mock("px4", lockstep=True)

    async def scene(session):
        await airborne(session, vehicle, "px4", 2.5)
        script = MemoryClient().connect(session)
        start = place(session)
        session.changes.change(BEFORE, "a test")
        await begin_control(session, script, "px4", lambda _: script.local(ALL, start))
        there = start[0] + 3.0, start[1] - 1.0, start[2]
        await stream(0.5, lambda _: script.local(POSITION, there))
        session.changes.change(IN_FLIGHT, "a test")
        await stream(1.0, lambda _: script.local(POSITION, there))
        session.changes.undo("a test")
        await stream(2.0, lambda _: script.local(POSITION, there))
        assert math.dist(place(session), there) < 0.3
        script.command(176, 1, 4, 3)
        await stream(0.5, lambda _: script.local(POSITION, there))

    served(vehicle, "px4", scene, directory=folder)
    return [(each.time, each.rates, each.thrust) for each in vehicle.setpoints]


@pytest.fixture(scope="module")
def flights(tmp_path_factory):
    folders = [tmp_path_factory.mktemp(name) for name in ("once", "again")]
    return [flown(folder) for folder in folders], [next(each.glob("*/")) for each in folders]


def test_equal_programs_give_equal_flights_to_the_bit(flights):
    (once, again), _ = flights
    assert len(once) > 500
    assert once == again


def test_a_replay_makes_the_changes_of_the_flight_and_gives_its_commands_to_the_bit(flights):
    _, (folder, _) = flights
    summary = json.loads((folder / "summary.json").read_text())
    assert [len(each["keys"]) for each in summary["changes"]] == [2, 2]
    config = load(folder / "config.yaml")
    assert config.guidance.position_weight_per_s4 == 120.0
    samples = Replay(read_flight(folder), config).run()
    assert [each for each in samples if not each.is_same] == []
    assert sum(each.recorded_setpoint is not None for each in samples) == summary["setpoints"]


def test_other_programs_read_the_log_of_a_served_flight(flights):
    """MAVExplorer reads by pymavlink and evaluates its expressions by `mavgraph`'s functions."""
    _, (folder, _) = flights
    log = mavutil.mavlink_connection(str(folder / "flight.tlog"), notimestamps=False)
    kinds, roll = {}, []
    while (message := log.recv_match()) is not None:
        kinds[message.get_type()] = kinds.get(message.get_type(), 0) + 1
        if message.get_type() == "ATTITUDE_QUATERNION":
            roll.append(mavutil.evaluate_expression("ATTITUDE_QUATERNION.q2*2", log.messages))
    assert "BAD_DATA" not in kinds
    sent = json.loads((folder / "summary.json").read_text())["setpoints"]
    assert kinds["SET_ATTITUDE_TARGET"] == sent
    assert log.flightmode == "OFFBOARD"
    assert max(roll) > 0.02
