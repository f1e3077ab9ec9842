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

from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as dialect

from companion.config import Config
from companion.flight.session import Session
from companion.mavlink.link import Link
from tests.fuzz import virtual_time
from tests.fuzz.channel import Channel
from tests.fuzz.family import ARDUPILOT, PX4
from tests.fuzz.judge import Judge
from tests.fuzz.messages import EVERY
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

    def waiting(self, name: str, detail: str, elapsed: float, timeout: float) -> None:
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
        session = Session(config, Path(name), outcome, _no)
        channel = Channel(
            vehicle, judge, case["events"], lambda: session.interrupt("the user (Ctrl-C)")
        )
        outcome.channel = channel
        opened = {"opener": channel.wire.open}
        living = asyncio.create_task(channel.run())
        pilot = asyncio.create_task(_pilot(vehicle, outcome)) if not case["arm"] else None
        with mock.patch(
            "companion.flight.session.open_link",
            lambda config, tap, notice: Link(_settings(config), tap, notice=notice, **opened),
        ):
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


def _settings(config: Config) -> Any:
    from companion.flight.assembly import link_settings  # noqa: PLC0415

    return link_settings(config)


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
            "programme": case["programme"],
            "arm": case["arm"],
            **{f"{name}_timeout_s": float(seconds) for name, seconds in times.items()},
        },
        "hover": {"duration_s": 1.0},
        "steps": {"duration_s": 0.3, "settle_s": 0.5},
        "circle": {"radius_m": 1.0, "speed_m_s": 1.0},
        # Of the wall clock, which has no say here.
        "safety": {"computer_action": "warn"},
    }


# --- cases

_PHASES = ("connect", "checks", "stream", "arm", "takeoff", "offboard", "programme", "hand back")
_PHASES += ("land", "disarm")
_LIKELY = st.sampled_from((*_PHASES, "takeoff", "offboard", "offboard", "programme", "programme"))
_values = st.one_of(
    st.sampled_from((0, 1, -1, 2, 3, 4, 5, 255, 65535, 2**31, 2**32 - 1, -(2**31), 2**63 - 1)),
    st.sampled_from((float("nan"), float("inf"), -float("inf"), 1e-40, 3.4e38, -3.4e38, 0.0)),
    st.floats(width=32),
    st.integers(-300, 300),
    st.floats(-50.0, 50.0).map(lambda by: {"add": by}),
)
_NAMES = tuple(EVERY)
_FIELDS = {
    kind.msgname: tuple(kind.fieldnames)
    for kind in dialect.mavlink_map.values()
    if kind.msgname in EVERY
    or kind.msgname in ("COMMAND_ACK", "PARAM_VALUE", "PARAM_ERROR", "TIMESYNC", "STATUSTEXT")
}
_seconds = st.one_of(st.floats(0.02, 3.0), st.sampled_from((0.03, 0.1, 0.3, 0.6, 1.2, 6.0)))
_COMMANDS = (400, 176, 22, 21, 511, 512)

_kinds = st.sampled_from(
    (
        *("field", "field", "field", "say", "say", "silence", "silence", "delay", "hold"),
        *("copies", "swap", "stamps", "restart", "mode", "armed", "deaf", "ack", "jump"),
        *("interrupt", "bytes"),
    )
)


@st.composite
def _events(draw: Any) -> dict[str, Any]:
    """One thing that goes wrong."""
    event: dict[str, Any] = {"phase": draw(_LIKELY), "after": draw(st.floats(0.0, 2.0))}
    event["kind"] = kind = draw(_kinds)
    if kind in ("field", "silence", "delay", "hold", "copies", "swap", "deaf"):
        event["seconds"] = draw(_seconds)
    match kind:
        case "field":
            event["message"] = draw(st.sampled_from(_NAMES))
            event["field"] = draw(st.sampled_from(_FIELDS[event["message"]]))
            event["value"] = draw(_values)
        case "say":
            event["message"] = name = draw(st.sampled_from(sorted(_FIELDS)))
            fields = st.dictionaries(st.sampled_from(_FIELDS[name]), _values, max_size=3)
            event["fields"] = draw(fields)
            event["count"] = draw(st.sampled_from((1, 1, 2, 20)))
            event["source"] = draw(st.sampled_from(([1, 1], [1, 1], [1, 2], [2, 1], [255, 190])))
        case "silence":
            some = st.lists(st.sampled_from(_NAMES), min_size=1, max_size=3, unique=True)
            event["messages"] = draw(st.one_of(st.none(), some))
        case "delay":
            event["by"] = draw(st.sampled_from((0.01, 0.05, 0.12, 0.3, 1.0)))
        case "copies":
            event["count"] = draw(st.integers(0, 4))
        case "stamps":
            ahead = st.sampled_from((1, 50, 1000, 60_000, 2**31, 2**32 - 30_000))
            event["by_ms"] = draw(ahead) * draw(st.sampled_from((1, -1)))
        case "mode":
            event["mode"] = draw(st.sampled_from(sorted(_MODES)))
        case "armed":
            event["armed"] = draw(st.booleans())
        case "ack":
            event["command"] = draw(st.sampled_from(_COMMANDS))
            event["result"] = draw(st.sampled_from((0, 1, 2, 3, 4, 5, 6, 200)))
        case "jump":
            event["by"] = draw(st.lists(st.floats(-20.0, 20.0), min_size=3, max_size=3))
        case "bytes":
            event["hex"] = draw(st.binary(max_size=40)).hex()
    return event


_MODES = {*PX4.ours, *PX4.foreign, *ARDUPILOT.ours, *ARDUPILOT.foreign, 2**32 - 1}
_programmes = st.sampled_from((["hover"], ["hover"], ["hover"], ["steps"], ["circle"], ["corners"]))
_cases = st.fixed_dictionaries(
    {
        "family": st.sampled_from(("px4", "ardupilot")),
        "arm": st.sampled_from((True, True, False)),
        "planner": st.sampled_from(("auto", "first-order", "exact", "quaternion", "so3", "euler")),
        "programme": _programmes,
        "events": st.lists(_events(), max_size=5),
    }
)

TARGET = Target("telemetry", _cases, _check, seconds=20.0)
