"""Frames of clients that must not disturb a session, and records that cannot be made."""

import asyncio
import gc
import math
import threading
from types import SimpleNamespace

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from companion.config import Config
from companion.config.files import changed
from companion.flight import flight_files
from companion.flight.changes import Changes
from companion.flight.environment import THIS_COMPUTER
from companion.mavlink.framing import FrameScanner
from companion.recording import recorder
from companion.recording.measurements.summary import LoopCounts, Summary
from companion.recording.trace import FlightTrace
from companion.serve.flight_records import FlightRecords
from companion.serve.flights import ServedFlights
from companion.serve.mode_requests import (
    asks_for_control,
    reduces_telemetry,
    steers_in_our_mode,
)
from companion.serve.network.addresses import Address
from companion.serve.network.network import Network
from companion.serve.ownership import NewestRequests, Program
from companion.vehicle.ardupilot.autopilot import ArduPilot
from companion.vehicle.px4.autopilot import Px4


def framed(message):
    return FrameScanner().feed(message.pack(dialect.MAVLink(None, 255, 190)))[0]


def command(number, *parameters):
    return framed(dialect.MAVLink_command_long_message(1, 1, number, 0, *parameters, *[0.0] * 4))


@pytest.mark.parametrize("number", [math.nan, math.inf, -math.inf])
def test_a_number_that_is_none_asks_for_nothing(number):
    assert asks_for_control(command(176, 1.0, 6.0, 0.0), Px4())
    assert not asks_for_control(command(176, number, 6.0, 0.0), Px4())
    assert reduces_telemetry(command(511, 31.0, -1.0, 0.0), {"ATTITUDE_QUATERNION": 250.0})
    assert not reduces_telemetry(command(511, number, -1.0, 0.0), {"ATTITUDE_QUATERNION": 250.0})


@pytest.mark.parametrize(
    ("frame", "asks"),
    [
        (command(176, 1.0, 6.0, 3.0), True),
        (command(176, 1.0, 6.7, math.nan), True),
        (command(176, 129.0, 262.0, 0.0), True),
        (command(176, 1.0, 4.0, 3.0), False),
        (command(92, 1.0, 0.0, 0.0), True),
        (command(92, 0.0, 0.0, 0.0), False),
        (framed(dialect.MAVLink_set_mode_message(1, 1, 6 << 16)), True),
        (framed(dialect.MAVLink_set_mode_message(1, 1, 2 << 24 | 6 << 16 | 5)), True),
        (framed(dialect.MAVLink_set_mode_message(1, 1, 3 << 24 | 4 << 16)), False),
    ],
)
def test_all_that_px4_takes_for_offboard_asks_for_control(frame, asks):
    assert asks_for_control(frame, Px4()) is asks


@pytest.mark.parametrize(
    ("frame", "steers"),
    [
        (command(192, -1.0, 1.0, 0.0), True),
        (command(193, 0.0, 0.0, 0.0), True),
        (command(176, 1.0, 6.0, 0.0), False),
        (framed(dialect.MAVLink_mission_item_int_message(1, 1, 0, 6, 16, 2, 1, *[0] * 7)), True),
        (framed(dialect.MAVLink_mission_item_message(1, 1, 0, 6, 16, 3, 1, *[0] * 7)), True),
        (framed(dialect.MAVLink_mission_item_int_message(1, 1, 0, 6, 16, 1, 1, *[0] * 7)), False),
        (framed(dialect.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)), False),
    ],
)
def test_what_ardupilot_would_fly_to_in_guided(frame, steers):
    assert steers_in_our_mode(frame, ArduPilot()) is steers
    assert not steers_in_our_mode(frame, Px4())


def test_a_command_under_another_component_id_is_of_the_program_that_was_heard_last():
    client, other = object(), object()
    requests, asked = NewestRequests(), command(176, 1.0, 6.0, 0.0)
    assert requests.sender_of(client, asked) == Program(client, Address(255, 190))
    for component, request in ((5, "old"), (6, "newest")):
        requests.keep(Program(client, Address(255, component)), request)
    requests.keep(Program(other, Address(255, 190)), "of another")
    found = requests.sender_of(client, asked)
    assert requests.get(found) == "newest"
    for number in range(40):
        requests.keep(Program(other, Address(1, number)), "many")
    assert requests.get(found) is None


def test_a_frame_that_causes_a_fault_is_dropped_and_told_once():
    notes, routed = [], []

    def forward_from_client(_, frame):
        if frame.text == "bad":
            raise ValueError("a fault")
        routed.append(frame.text)

    network = object.__new__(Network)
    network.routing = SimpleNamespace(forward_from_client=forward_from_client)
    network._noted_faults, network._note_event = set(), notes.append
    network._flush_later, network.setpoint_ids = lambda: None, frozenset()
    frames = [SimpleNamespace(message_id=0, text=text) for text in ("bad", "good", "bad", "good")]
    network.receive_frames(SimpleNamespace(name="script"), frames)
    assert routed == ["good", "good"]
    (told,) = notes
    assert "a fault" in told


async def test_a_record_that_cannot_be_opened_leaves_a_flight_without_record(tmp_path, monkeypatch):
    def full(*_):
        raise OSError("No space left on device")

    notes = []
    records = FlightRecords(tmp_path, THIS_COMPUTER, notes.append)
    with monkeypatch.context() as patched:
        patched.setattr(recorder, "McapWriter", full)
        record = records.new_record(Config())
    assert record.folder is None
    with records.recording(record):
        pass
    (told,) = notes
    assert "this flight is not recorded: No space left on device" in told
    assert list(tmp_path.iterdir()) == []

    changes = Changes(Config())
    changes.change({"planner": {"gain_per_s": 4.9}}, "a test")
    with records.recording(records.new_record(changes.begin_flight())) as _:
        changes.change({"planner": {"gain_per_s": 4.8}}, "a test")
    (folder,) = tmp_path.iterdir()
    assert "gain_per_s: 4.9" in (folder / "config.yaml").read_text()
    (change,) = changes.changes_in_flight
    assert change.keys[0].after == 4.8
    assert changes.config_at_flight_start.planner.gain_per_s == 4.9


async def test_what_is_to_be_told_of_a_record_is_told_in_the_event_loop(tmp_path, monkeypatch):
    """The record is written in a thread, beside the next flight."""
    told, here = [], threading.get_ident()

    def page(_):
        assert threading.get_ident() != here
        return "a page"

    def note(text):
        told.append((threading.get_ident(), text))

    records = FlightRecords(tmp_path, THIS_COMPUTER, note)
    records.on_recorded = page
    record = records.new_record(Config())
    with records.recording(record):
        pass
    monkeypatch.setattr(flight_files, "write_with_timeout", lambda *_: "the disk is full")
    await records.keep(record, Summary("ok", "", "", 1.0, LoopCounts(), {}, FlightTrace()))
    await asyncio.sleep(0.01)
    assert {thread for thread, _ in told} == {here}
    texts = " ".join(text for _, text in told)
    assert all(words in texts for words in ("the disk is full", "recorded in", "a page"))


@pytest.mark.parametrize(
    ("freeze_gc", "next_flight", "times"),
    [(True, None, 1), (True, "begun", 0), (False, None, 0)],
)
def test_garbage_is_collected_only_between_flights(monkeypatch, freeze_gc, next_flight, times):
    collected = []
    monkeypatch.setattr(gc, "collect", lambda: collected.append(1))

    async def run(_):
        return True

    async def save():
        flights.current_flight = next_flight

    flights = SimpleNamespace(
        ownership=SimpleNamespace(release=lambda: None),
        fence=SimpleNamespace(set_first_centre=lambda centre: None),
        _controlled_since_arming=False,
        _vehicle=SimpleNamespace(
            config=changed(Config(), {"realtime": {"freeze_gc": freeze_gc}}, "test")
        ),
    )
    flight = SimpleNamespace(run=run, save=save, fence_centre=None)
    asyncio.run(ServedFlights._fly(flights, flight, None))
    assert len(collected) == times
