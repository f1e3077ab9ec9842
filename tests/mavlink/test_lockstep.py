"""Lockstep: strict alternation, vehicle time, the same bytes each time."""

import asyncio
import time

import pytest
from pymavlink.dialects.v20 import common as dialect

from companion.attitude import BodyRates
from companion.mavlink import lockstep
from companion.mavlink.errors import LinkTimeout
from companion.mavlink.outbox import Outbox
from companion.mavlink.settings import LinkSettings
from companion.mavlink.stats import LinkStats
from companion.mavlink.transport import udp
from companion.mavlink.transport.free_port import free_port
from companion.vehicle.link import Link
from tests.mavlink.fakes import LockstepVehicle, attitude, heartbeat, until

LEVEL = BodyRates(0.0, 0.0, 0.0)
ACK = dialect.MAVLink_command_ack_message


def settings(port, **more):
    return LinkSettings(endpoint=f"udpin://127.0.0.1:{port}", lockstep=True, **more)


def telemetry(now):
    return [heartbeat(), attitude(now)] if now % 100 == 4 else [attitude(now)]


def accept(message):
    if message.get_type() == "COMMAND_LONG":
        return [ACK(message.command, 0, 0, 0, 1, 191)]
    if message.get_type() == "TIMESYNC" and message.tc1 == 0:
        return [dialect.MAVLink_timesync_message(1_000_000, message.ts1)]
    return []


async def fly_a_little(link):
    """Some of everything that a flight does at once."""
    trace = []

    def control(sample):
        trace.append(("sample", sample.received, sample.time_boot_ms))
        if sample.time_boot_ms % 12 == 0:
            link.send_setpoint(sample.time_boot_ms, BodyRates(0.1, 0.2, 0.3), 0.5)

    async def tick(period, name):
        for _ in range(20):
            await asyncio.sleep(period)
            trace.append((name, asyncio.get_running_loop().time()))

    link.on_attitude = control
    await link.wait_connected(5.0)
    async with asyncio.TaskGroup() as group:
        group.create_task(tick(0.01, "fast"))
        group.create_task(tick(0.025, "slow"))
        group.create_task(link.command(400, 1.0))
        group.create_task(link.set_rates({"ATTITUDE": 50.0, "ODOMETRY": 30.0}, window_s=0.3))
    return trace


def one_flight(steps=200, **options):
    port, taped = free_port(), []
    vehicle = LockstepVehicle(port, steps, telemetry, accept, **options)

    async def scene():
        tap = lambda now, frame: taped.append((now, frame))  # noqa: E731
        async with Link(settings(port), tap) as link:
            trace = await fly_a_little(link)
            assert (link.stats.lost, link.stats.repeated) == (0, 0)
            return trace

    vehicle.start()
    trace = lockstep.run(scene())
    return trace, vehicle.log, taped


def test_two_flights_are_the_same_to_the_bit():
    first_trace, first_log, first_tape = one_flight()
    second_trace, second_log, second_tape = one_flight()
    assert first_trace == second_trace
    length = min(len(first_log), len(second_log))  # the vehicle's thread ends when it likes
    assert length > 120
    assert first_log[:length] == second_log[:length]
    assert first_tape == second_tape


def test_repeated_beacons_change_nothing():
    assert one_flight()[0] == one_flight(repeat_beacons=True)[0]


def test_tasks_run_on_vehicle_time():
    trace, _, tape = one_flight()
    fast = [entry[1] for entry in trace if entry[0] == "fast"]
    assert fast[0] == pytest.approx(0.016)  # connected at 4 ms; the first step at or past 14 ms
    assert all(round(1000 * step) % 4 == 0 for step in fast)
    for name, received, *stamp in (entry for entry in trace if entry[0] == "sample"):
        assert (name, received) == ("sample", stamp[0] / 1000.0)
    assert [now for now, _ in tape] == sorted(now for now, _ in tape)


def test_the_answer_is_the_last_word_of_each_step():
    _, log, tape = one_flight()
    steps = {}
    for now, name, _ in log:
        steps.setdefault(now, []).append(name)
    closing = {"SYSTEM_TIME", "SET_ATTITUDE_TARGET"}
    assert any(len(names) > 1 for names in steps.values())
    for now, names in list(steps.items())[:-1]:
        assert names[-1] in closing, (now, names)
        assert not closing & set(names[:-1]), (now, names)
        if now and now % 12 == 0:
            assert names[-1] == "SET_ATTITUDE_TARGET"
    # Neither beacons nor bare answers are recorded.
    assert not [frame for _, frame in tape if frame[7] == 2]


def test_what_a_sample_sets_off_is_sent_before_the_answer():
    port, heard = free_port(), []
    vehicle = LockstepVehicle(port, 60, telemetry, lambda message: heard.append(message) or [])

    async def scene():
        async with Link(settings(port)) as link:
            woken = asyncio.Event()

            def control(sample):
                link.send_setpoint(sample.time_boot_ms, LEVEL, 0.5)
                if sample.time_boot_ms == 100:
                    woken.set()

            link.on_attitude = control
            await woken.wait()
            await asyncio.sleep(0)
            link.send(dialect.MAVLink_statustext_message(6, b"woken", 0, 0))
            await asyncio.sleep(0.05)

    vehicle.start()
    lockstep.run(scene())
    at_100 = [name for now, name, _ in vehicle.log if now == 100]
    assert at_100 == ["TIMESYNC", "STATUSTEXT", "SET_ATTITUDE_TARGET"]


def test_the_newest_setpoint_of_a_step_is_its_answer():
    port = free_port()
    vehicle = LockstepVehicle(port, 30, telemetry)

    async def scene():
        async with Link(settings(port)) as link:

            def control(sample):
                link.send_setpoint(sample.time_boot_ms, BodyRates(9.0, 0.0, 0.0), 0.1)
                link.send_setpoint(sample.time_boot_ms, LEVEL, 0.75)

            link.on_attitude = control
            await asyncio.sleep(0.08)

    vehicle.start()
    lockstep.run(scene())
    answers = [payload for now, name, payload in vehicle.log if name == "SET_ATTITUDE_TARGET"]
    assert len(answers) >= 19
    thrusts = {dialect.MAVLink_set_attitude_target_message.unpacker.unpack(a)[8] for a in answers}
    assert thrusts == {0.75}


def test_a_task_that_never_rests_cannot_stop_the_world():
    port = free_port()
    vehicle = LockstepVehicle(port, 40, telemetry)

    async def restless():
        while True:  # noqa: ASYNC110
            await asyncio.sleep(0)

    async def scene():
        async with Link(settings(port)) as link:
            task = asyncio.create_task(restless())
            await asyncio.sleep(0.1)
            task.cancel()
            assert link.stats.by_message[31] >= 24

    vehicle.start()
    lockstep.run(scene())


def test_no_beacon_is_said_clearly():
    async def scene():
        with pytest.raises(LinkTimeout, match="lockstep beacon"):
            async with Link(settings(free_port(), first_beacon_timeout_s=0.05)):
                pass

    lockstep.run(scene())


def test_when_the_vehicle_is_gone_timeouts_still_end(monkeypatch):
    monkeypatch.setattr(lockstep, "BEACON_TIMEOUT_S", 0.05)
    port = free_port()
    vehicle = LockstepVehicle(port, 10, telemetry)

    async def scene():
        async with Link(settings(port)) as link:
            await link.wait_connected(5.0)
            began = time.monotonic()
            with pytest.raises(TimeoutError):
                async with asyncio.timeout(0.3):
                    await asyncio.Event().wait()
            assert time.monotonic() - began < 5.0

    vehicle.start()
    lockstep.run(scene())


def test_a_vehicle_that_starts_anew_does_not_turn_our_time_back(monkeypatch):
    monkeypatch.setattr(lockstep, "BEACON_TIMEOUT_S", 0.05)
    monkeypatch.setattr(udp, "PEER_SILENCE_S", 0.2)
    port = free_port()
    first, second = LockstepVehicle(port, 500, telemetry), LockstepVehicle(port, 200, telemetry)

    async def scene():
        async with Link(settings(port)) as link:
            loop = asyncio.get_running_loop()
            await asyncio.sleep(1.9)
            await until(lambda: not first.is_alive())
            second.start()
            before, seen = loop.time(), []
            link.on_attitude = lambda sample: seen.append((sample.time_boot_ms, loop.time()))
            await until(lambda: len(seen) >= 50)
            stamps, times = zip(*seen, strict=True)
            assert before >= 1.9
            assert min(times) >= before
            assert list(times) == sorted(times)
            assert stamps[0] == 4

    first.start()
    lockstep.run(scene())


def test_a_setpoint_of_a_step_is_not_called_sent_without_a_connection():
    async def latched():
        return Outbox(settings(1), LinkStats(), None).latch(4, LEVEL, 0.5)

    assert asyncio.run(latched()) is False
