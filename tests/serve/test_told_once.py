"""What `companion serve` shows: each change of the vehicle's state once, all on one clock."""

import asyncio
import io
from itertools import pairwise

import pytest

from companion.cli import serve as command
from companion.cli.terminal import FlightConsole
from companion.flight.observer import SilentObserver
from companion.serve import session as session_module
from tests.serve.virtual import POSITION, MemoryClient, airborne, begin_control, mock, served

HOLD = {"px4": (176, 1, 4, 3), "ardupilot": (176, 1, 17)}


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
def test_a_mode_change_in_a_served_flight_is_told_once(autopilot, monkeypatch):
    told = []

    class Observer(SilentObserver):
        def event(self, _, text):
            told.append(text)

    monkeypatch.setattr(session_module, "SilentObserver", Observer)
    vehicle = mock(autopilot)

    async def scene(session):
        await airborne(session, vehicle, autopilot)
        script = MemoryClient().connect(session)
        place = vehicle.state()["position"]
        await begin_control(session, script, autopilot, lambda _: script.local(POSITION, place))
        script.command(*HOLD[autopilot])
        async with asyncio.timeout(10.0):
            while session.flights.in_control:  # noqa: ASYNC110  it sets no event
                await asyncio.sleep(0.1)
        await asyncio.sleep(3.0)

    served(vehicle, autopilot, scene, notes=told)
    modes = [text for text in told if text.startswith("mode ")]
    assert "mode OFFBOARD" in modes or autopilot == "ardupilot"
    # A flight begins by telling the present mode, so that its record has it.
    assert sum(first == second for first, second in pairwise(modes)) <= 1, told
    assert modes.count("mode OFFBOARD") <= 1
    texts = [text for text in told if text.startswith("autopilot: ")]
    assert len(texts) == len(set(texts)), texts


def test_events_of_flights_and_of_the_command_are_on_one_clock(monkeypatch):
    now = iter((100.0, 112.0, 190.5))
    monkeypatch.setattr(command.time, "monotonic", lambda: next(now))
    shown = io.StringIO()
    observer = command._ServeObserver(FlightConsole(file=shown))
    observer.event(12.0, "outside a flight")
    observer.event(3.5, "in its second flight")
    observer.close()
    assert shown.getvalue() == "    12.0 s  outside a flight\n    90.5 s  in its second flight\n"
