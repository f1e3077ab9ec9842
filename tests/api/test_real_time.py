"""Programs that block, compute, spin, or end in flight, in real time over a socket."""

import json
import signal
import subprocess
import sys
import time
from contextlib import contextmanager, suppress

import pytest

import companion
from companion.files import bounded_yaml
from tests.flight.fly import quick_flight
from tests.flight.sockets import mock_vehicle

HELD = {"px4": "LOITER", "ardupilot": "BRAKE"}
BEGIN = """
import asyncio, sys
import companion
"""
NEVER_YIELDS = """
async def main():
    async with companion.connect(sys.argv[1]) as vehicle:
        await vehicle.take_off()
        async with vehicle.control() as control:
            async for state in control.states():
                control.accelerate((0.3, 0.0, 0.0))
                while state.velocity_ned[0] > 0.3:
                    pass

companion.run(main())
"""
SPINS_BETWEEN_CALLS = """
async def main():
    async with companion.connect(sys.argv[1]) as vehicle:
        await vehicle.take_off()
        print("holding", flush=True)
        while True:
            pass

companion.run(main())
"""
ENDS_WITHOUT_CLOSING = """
async def main():
    global connection
    connection = companion.connect(sys.argv[1])
    vehicle = await connection.__aenter__()
    await vehicle.take_off()

loop = asyncio.new_event_loop()
loop.run_until_complete(main())
print("holding", flush=True)
"""
COMPUTES = """
import time

async def main():
    async with companion.connect(sys.argv[1]) as vehicle:
        await vehicle.take_off()
        async with vehicle.control() as control:
            async for state in control.states(seconds=5.0):
                control.accelerate(tuple(-speed for speed in state.velocity_ned))
                done = time.monotonic() + 0.05
                while time.monotonic() < done:
                    pass
        await vehicle.land()

companion.run(main())
"""
SLOW = pytest.mark.slow


@contextmanager
def program(folder, autopilot, source):
    """A program in a process of its own, and its mock vehicle."""
    with mock_vehicle(folder, in_lockstep=False, autopilot=autopilot, speed=1.0) as mock:
        endpoint = f"udpin://127.0.0.1:{mock.port}"
        recording = {"recording": {"directory": str(folder / "flights")}}
        config = quick_flight(
            autopilot, recording, endpoint=endpoint, attitude_rate_hz=mock.rate_hz
        )
        file = folder / "companion.yaml"
        file.write_text(bounded_yaml.dump(config.model_dump(mode="json")))
        running = subprocess.Popen(
            [sys.executable, "-c", BEGIN + source, file],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        try:
            yield running, mock
        finally:
            running.kill()
            running.communicate()


def summary(folder):
    (path,) = (folder / "flights").glob("*/summary.json")
    return json.loads(path.read_text())


def interrupted(running):
    """Press Ctrl-C until the program has ended; returns what it said.

    Two signals that come before Python handles the first one count as one.
    """
    for _ in range(30):
        running.send_signal(signal.SIGINT)
        with suppress(subprocess.TimeoutExpired):
            return running.communicate(timeout=1.0)[1]
    raise AssertionError("it did not end")


def held(mock, autopilot):
    """Wait until the autopilot holds the vehicle at rest."""
    return mock.until(
        lambda state: state["mode"] == HELD[autopilot] and abs(state["velocity"][0]) < 0.1
    )


@pytest.mark.parametrize("autopilot", ["px4", pytest.param("ardupilot", marks=SLOW)])
def test_a_coroutine_that_blocks_for_a_second_leaves_the_vehicle_held(tmp_path, autopilot):
    with mock_vehicle(tmp_path, in_lockstep=False, autopilot=autopilot, speed=1.0) as mock:
        endpoint = f"udpin://127.0.0.1:{mock.port}"
        config = quick_flight(autopilot, {}, endpoint=endpoint, attitude_rate_hz=mock.rate_hz)

        async def main():
            async with companion.connect(config, folder=tmp_path) as vehicle:
                await vehicle.take_off()
                blocked = False
                async with vehicle.control() as control:
                    async for _ in control.states(seconds=10.0):
                        control.accelerate((0.3, 0.0, 0.0))
                        if not blocked and control.state.velocity_ned[0] > 0.3:
                            blocked = True
                            time.sleep(1.0)  # noqa: ASYNC251

        with pytest.raises(companion.FlightEnded, match="no new command"):
            companion.run(main())
        state = held(mock, autopilot)
    assert (state["armed"], state["crashed"]) == (True, False)


@SLOW  # it spins on a whole core, and other tests in real time would miss it
@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_a_coroutine_that_never_yields_is_held_and_handed_back(tmp_path, autopilot):
    """The flight ends without it; Ctrl-C, and once more, then ends the program itself."""
    with program(tmp_path, autopilot, NEVER_YIELDS) as (running, mock):
        mock.until(lambda state: state["velocity"][0] > 0.25, 40.0)
        state = held(mock, autopilot)
        assert running.poll() is None, "it still spins"
        said = interrupted(running)
    assert (state["armed"], state["crashed"]) == (True, False)
    assert "the program gave no new command for" in summary(tmp_path)["result"]
    assert "KeyboardInterrupt" in said


@SLOW
@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
def test_ctrl_c_hands_back_while_a_program_spins_between_its_calls(tmp_path, autopilot):
    with program(tmp_path, autopilot, SPINS_BETWEEN_CALLS) as (running, mock):
        assert running.stdout.readline() == "holding\n"
        time.sleep(1.0)
        assert mock.state()["mode"] in ("OFFBOARD", "GUIDED")
        running.send_signal(signal.SIGINT)
        state = held(mock, autopilot)
        assert running.poll() is None, "it still spins"
        running.send_signal(signal.SIGINT)
        _, said = running.communicate(timeout=20.0)
    assert (state["armed"], state["crashed"]) == (True, False)
    assert summary(tmp_path)["result"] == "interrupted by the user (Ctrl-C)"
    assert "KeyboardInterrupt" in said


@SLOW
@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
def test_an_interpreter_that_ends_in_flight_hands_back_first(tmp_path, autopilot):
    with program(tmp_path, autopilot, ENDS_WITHOUT_CLOSING) as (running, mock):
        assert running.stdout.readline() == "holding\n"
        running.communicate(timeout=20.0)
        state = held(mock, autopilot)
    assert (state["armed"], state["crashed"]) == (True, False)
    assert summary(tmp_path)["result"] == "the program ended in flight"


@SLOW
@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
def test_a_program_that_computes_for_50_ms_a_command_flies_on(tmp_path, autopilot):
    with program(tmp_path, autopilot, COMPUTES) as (running, mock):
        running.communicate(timeout=60.0)
        assert not mock.state()["crashed"]
    flown = summary(tmp_path)
    assert flown["result"] == "ok"
    assert flown["missed_deadlines"] < 0.25 * flown["setpoints"]
