"""Whole flights in virtual time, by a vehicle whose telemetry is wrong in all ways it can be.

A case is a script of what goes wrong (`tests.fuzz.channel`). The flight is the program's own, from
session to link; only the sockets are missing. `tests.fuzz.judge` looks at all that is sent.
"""

import asyncio
import logging
import tempfile
from pathlib import Path
from typing import Any
from unittest import mock

from companion.config import Config
from companion.flight.environment import Environment
from companion.flight.session import Session
from companion.flight.status import FlightStatus
from tests.fuzz import virtual_time
from tests.fuzz.channel import Channel
from tests.fuzz.family import ARDUPILOT, PX4
from tests.fuzz.judge import Judge
from tests.fuzz.scripts import cases
from tests.fuzz.target import Case, Target
from tests.fuzz.vehicle import Vehicle

_LONGEST_FLIGHT = 300.0
"""Virtual time after which a flight must be over, s: all that its phases may take."""
_FAMILIES = {"px4": PX4, "ardupilot": ARDUPILOT}


class Outcome:
    """What came of a flight.

    Attributes:
        result: "ok", or why it ended.
        phases: their names, in order.
        events: what was told.
        setpoints: how many were sent.
        faults: what the judge found.
        seconds: how long it took, in virtual time.
    """

    def __init__(self) -> None:
        self.result = ""
        self.phases: list[str] = []
        self.events: list[str] = []
        self.setpoints = 0
        self.faults: list[str] = []
        self.seconds = 0.0
        self.channel: Channel | None = None

    def phase(self, name: str, waits_for: str) -> None:
        """A phase began."""
        self.phases.append(name)
        if self.channel is not None:
            self.channel.phase(name)

    def waiting(self, name: str, waiting_for: str, elapsed: float, timeout: float) -> None:
        """Nothing."""

    def status(self, status: FlightStatus) -> None:
        """Nothing."""

    def event(self, time: float, text: str) -> None:
        """Something happened."""
        self.events.append(text)


def fly(case: Case) -> Outcome:
    """Fly one case."""
    outcome = Outcome()
    # What the link's callbacks raise goes to the log, unless a flight is told of it.
    with mock.patch.object(logging.Logger, "error", _fail), _quiet():
        virtual_time.run(_flown(case, outcome))
    return outcome


def _check(case: Case) -> None:
    outcome = fly(case)
    assert not outcome.faults, outcome.faults
    internal = [text for text in outcome.events if "internal error" in text]
    assert not internal, internal


def _fail(_logger: Any, message: str, *args: Any, **options: Any) -> None:
    error = options.get("exc_info")
    raise AssertionError(f"logged: {message}") from (error if error is not True else None)


def _quiet() -> Any:
    return mock.patch.object(logging.Logger, "warning")


async def _flown(case: Case, outcome: Outcome) -> None:
    loop = asyncio.get_running_loop()
    config = Config.model_validate(_configuration(case))
    vehicle = Vehicle(_FAMILIES[case["family"]])
    judge = Judge(vehicle, config.model_dump(mode="json"))
    with tempfile.TemporaryDirectory(prefix="fuzz-") as name:
        channel = Channel(
            vehicle, judge, case["events"], lambda: session.interrupt("the user (Ctrl-C)")
        )
        environment = Environment(channel.wire.open, realtime=False)
        session = Session(config, Path(name), outcome, _no, environment=environment)
        outcome.channel = channel
        living = asyncio.create_task(channel.run())
        pilot = asyncio.create_task(_pilot(vehicle, outcome)) if not case["arm"] else None
        try:
            async with asyncio.timeout(_LONGEST_FLIGHT):
                summary = await session.fly()
        finally:
            living.cancel()
            if pilot is not None:
                pilot.cancel()
        outcome.result = summary.result
        judge.over = True
        await asyncio.sleep(1.0)
    outcome.setpoints, outcome.faults = judge.setpoints, judge.faults
    outcome.seconds = loop.time() - 100.0


async def _no() -> bool:
    return False


async def _pilot(vehicle: Vehicle, outcome: Outcome) -> None:
    """A pilot who arms when asked to, and hands over."""
    while "arm" not in outcome.phases:  # noqa: ASYNC110  an observer sets no events
        await asyncio.sleep(0.1)
    await asyncio.sleep(0.5)
    vehicle.mode = vehicle.family.foreign[0]
    vehicle.armed = True
    await asyncio.sleep(1.5)
    vehicle.mode = vehicle.family.ready


def _configuration(case: Case) -> dict[str, Any]:
    times = {"connect": 5, "ready": 10, "arming": 8, "takeoff": 10, "landing": 10}
    return {
        "link": {"min_attitude_rate_hz": 15, "min_position_rate_hz": 5},
        "planner": {"name": case["planner"]},
        "vehicle": {"lag_ms": 30.0, "dead_time_ms": 20.0},
        "flight": {
            "takeoff_height_m": 2.0,
            "maneuvers": case["maneuvers"],
            "arm": case["arm"],
            **{f"{name}_timeout_s": float(seconds) for name, seconds in times.items()},
        },
        "hover": {"duration_s": 1.0},
        "steps": {"duration_s": 0.3, "settle_s": 0.5},
        "circle": {"radius_m": 1.0, "speed_m_s": 1.0},
        # Of the wall clock, which has no say here.
        "safety": {"computer_action": "warn"},
    }


TARGET = Target("telemetry", cases, _check, seconds=20.0)
