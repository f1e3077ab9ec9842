"""A flight that ends early says why: in its summary, and to each later call of the program."""

import asyncio
import gc
import json
from functools import partial

import pytest

import companion
from companion.api.program import ProgramPlan
from companion.files.yaml_file import ConfigError
from companion.testing import connect, run
from tests.api.test_flying import BOTH, Told, flown
from tests.flight.fly import QUICK_FLIGHT, QuickVehicle

CANCELLED = "the program cancelled its request"


async def reasons(vehicle):
    """What each kind of call says; `land` last, because it waits for the end of the flight."""

    async def take_control():
        async with vehicle.control():
            pass

    said = []
    for call in (partial(vehicle.go_to, (1.0, 0.0, -2.0)), vehicle.take_off, take_control):
        with pytest.raises(companion.FlightEnded) as ended:
            await call()
        said.append(str(ended.value))
    with pytest.raises(companion.FlightEnded) as ended:
        await vehicle.land()
    return [*said, str(ended.value)]


@BOTH
def test_after_a_cancelled_call_the_next_ones_say_that_it_was_cancelled(autopilot):
    """They said that another call had not ended yet, or that the vehicle must take off first."""
    said = []

    async def program(vehicle):
        await vehicle.take_off()
        with pytest.raises(TimeoutError):
            await asyncio.wait_for(vehicle.go_to((6.0, 0.0, -2.0)), 1.0)
        said.extend(await reasons(vehicle))

    mock = QuickVehicle(autopilot)
    summary, _ = flown(program, mock)
    assert said == [CANCELLED] * 4
    assert summary.result == CANCELLED
    assert mock.state()["mode"] in ("LOITER", "BRAKE")


@BOTH
def test_while_a_monitor_lands_the_vehicle_calls_say_what_it_said(autopilot):
    """`go_to` said "take off first", and `take_off` "the vehicle flies already"."""
    said = []

    async def program(vehicle):
        await vehicle.take_off()
        mock.inject({"kind": "low_battery"})
        landing = asyncio.Event()
        mock.when(lambda: mock.state()["mode"] == "LAND", landing.set)
        await asyncio.wait_for(landing.wait(), 10.0)
        await asyncio.sleep(0.5)  # until the flight has heard of the mode
        assert mock.state()["armed"]
        said.extend(await reasons(vehicle))

    mock = QuickVehicle(autopilot)
    flown(program, mock)
    assert len(said) == 4
    assert all("limits.min_battery_percent" in text for text in said), said


async def drift(vehicle):
    """Fly without acceleration until cancelled."""
    async with vehicle.control() as control:
        async for _ in control.states():
            control.accelerate((0.0, 0.0, 0.0))


def test_a_time_out_around_a_control_block_is_no_error_of_the_program():
    """The result was "the program raised CancelledError()"."""

    async def program(vehicle):
        await vehicle.take_off()
        with pytest.raises(TimeoutError):
            await asyncio.wait_for(drift(vehicle), 1.0)

    summary, _ = flown(program, QuickVehicle())
    assert summary.result == "the program was cancelled"


def test_a_control_block_that_is_cancelled_twice_leaves_no_warning():
    """Python told of a "Task exception was never retrieved" beside the CancelledError."""

    async def program(vehicle):
        await vehicle.take_off()
        drifting = asyncio.ensure_future(drift(vehicle))
        for seconds in (1.0, 0.02):
            await asyncio.sleep(seconds)
            drifting.cancel()
        await asyncio.wait({drifting})
        await asyncio.sleep(1.0)
        del drifting
        gc.collect()

    summary, _ = flown(program, QuickVehicle())  # raises UnhandledError
    assert summary.result == "the program was cancelled"


@pytest.mark.parametrize("slow_down", [False, True])
def test_a_refused_go_to_says_what_helps_in_a_program(slow_down):
    """It advised `--slow-down` and `flight.slow_down`, which change nothing of a program's."""

    async def program(vehicle):
        await vehicle.take_off()
        north, east, down = vehicle.state.position_ned
        below = north, east, down + 2.0
        with pytest.raises(ConfigError, match=r"max_descent.*lower speed") as refused:
            await vehicle.go_to(below, speed=2.0)  # above limits.max_descent_m_s
        assert "--slow-down" not in str(refused.value)
        await vehicle.go_to(below, speed=0.9)
        await vehicle.land()

    flight = {"takeoff_height_m": 4.0, "slow_down": slow_down}
    summary, events = flown(program, QuickVehicle(), flight=flight)
    assert summary.result == "ok", events


@pytest.mark.parametrize("in_the_air", [False, True])
def test_a_program_that_raises_between_two_calls_is_the_result_of_the_flight(tmp_path, in_the_air):
    """It was "ok", as if the program had ended as it should."""

    async def program(vehicle):
        if in_the_air:
            await vehicle.take_off()
        raise ZeroDivisionError("mine")

    mock = QuickVehicle()
    with pytest.raises(ZeroDivisionError):
        flown(program, mock, tmp_path)
    summary = json.loads((tmp_path / "summary.json").read_text("utf-8"))
    assert summary["result"] == "the program raised ZeroDivisionError('mine')"
    assert (mock.state()["mode"], mock.state()["armed"]) == ("LOITER", in_the_air)


def test_a_program_that_raises_after_its_landing_has_flown_well(tmp_path):
    async def program(vehicle):
        await vehicle.take_off()
        await vehicle.land()
        raise ZeroDivisionError("mine")

    with pytest.raises(ZeroDivisionError):
        flown(program, QuickVehicle(), tmp_path)
    summary = json.loads((tmp_path / "summary.json").read_text("utf-8"))
    assert summary["result"] == "ok"
    assert "the program raised ZeroDivisionError('mine')" in str(summary["events"])


async def test_a_program_cancelled_while_it_connects_leaves_no_warning():
    """Python told of a "Future exception was never retrieved" after a Ctrl-C in `connect`."""
    told = []
    asyncio.get_running_loop().set_exception_handler(lambda _, context: told.append(context))
    ProgramPlan().end(companion.FlightEnded("interrupted"))
    gc.collect()
    assert not told


def test_a_connection_that_is_dropped_in_flight_is_told_in_words():
    """As by a cell of a notebook that runs twice; it was "the program raised GeneratorExit()"."""
    told, mock = Told(), QuickVehicle()

    async def main():
        connection = connect(QUICK_FLIGHT, mock, observer=told)
        vehicle = await connection.__aenter__()
        await vehicle.take_off()
        del connection
        await asyncio.sleep(3.0)
        return vehicle.summary.result

    assert run(mock, main()) == "the program dropped its connection"
    assert mock.state()["mode"] == "LOITER"


def test_run_of_a_function_that_was_not_called_says_what_to_write_instead():
    """It raised AttributeError: 'function' object has no attribute 'close'."""

    async def main():
        raise AssertionError

    with pytest.raises(ValueError, match=r"as in companion\.run\(main\(\)\), not <function"):
        companion.run(main)


async def test_run_in_a_running_loop_says_what_to_write_instead():
    """Python spoke of loops and left "coroutine was never awaited" behind."""
    with pytest.raises(RuntimeError, match=r"write `await main\(\)`"):
        companion.run(asyncio.sleep(0))
