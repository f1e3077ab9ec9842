"""Flies the companion against a hostile autopilot, and holds every flight to the same rules."""

import asyncio
from dataclasses import replace
from typing import NamedTuple
from unittest.mock import patch

import yaml

from companion.config import Config
from companion.files.yaml_file import parse
from companion.flight.observer import SilentObserver
from companion.flight.session import Session
from companion.mavlink import lockstep
from companion.mavlink.transport.free_port import free_port
from companion.testing import environment
from companion.vehicle import link
from companion.vehicle.clock import VehicleClock
from tests.flight.fly import merged
from tests.flight.sockets import decline
from tests.hostile.autopilot import HostileAutopilot
from tests.hostile.body import HOVER_THRUST
from tests.hostile.wire import MemoryWorld, SocketThread, Wire

lockstep._BUSY_WAIT_S = 0.0  # the cores are busy with other flights

CONFIG = {
    "link": {
        "lockstep": True,
        "attitude_rate_hz": 50.0,
        "min_attitude_rate_hz": 30.0,
        "position_rate_hz": 25.0,
    },
    "flight": {
        "arm": True,
        "takeoff_height_m": 2.0,
        "maneuvers": ["hover"],
        "ready_timeout_s": 6.0,
        "arming_timeout_s": 4.0,
        "takeoff_timeout_s": 6.0,
        "landing_timeout_s": 5.0,
    },
    "hover": {"duration_s": 1.5},
    "guidance": {"drag_per_s": 0.3},
    "thrust": {"hover_thrust": HOVER_THRUST},
}


class Flown(NamedTuple):
    """A flight that is over.

    Attributes:
        result: what the program said, "ok" or the reason.
        events: what it said on the way, in one text.
        autopilot: the hostile one, with its record.
        config: flown.
        pilot_modes: as in `Scenario`.
    """

    result: str
    events: str
    autopilot: HostileAutopilot
    config: Config


def fly(kind, script, folder, *, mode=None, **changes):
    """One flight in memory."""
    autopilot = HostileAutopilot(kind, script, mode)
    world = MemoryWorld(autopilot, kind.dialect)
    surroundings = replace(environment, open_transport=world.open)
    config = _config("udpin://127.0.0.1:1", changes)
    session = Session(config, None, SilentObserver(), decline, environment=surroundings)
    with _own_clock(), asyncio.Runner(loop_factory=world.make_loop) as runner:
        summary = runner.run(session.fly())
    return _flown(summary, autopilot, config)


def fly_over_sockets(kind, script, folder, *, mode=None, late_by=None, **changes):
    """One flight over UDP; `late_by` is called with the vehicle's wire before its first step."""
    port = free_port()
    autopilot = HostileAutopilot(kind, script, mode)
    vehicle = SocketThread(autopilot, Wire(port, kind.dialect))
    if late_by is not None:
        vehicle.late_by = lambda: late_by(vehicle.wire)
    config = _config(f"udpin://127.0.0.1:{port}", changes)
    session = Session(config, folder, SilentObserver(), decline)
    vehicle.start()
    try:
        with _own_clock():
            summary = lockstep.run(session.fly())
    finally:
        vehicle.end()
    return _flown(summary, autopilot, config)


def _config(endpoint, changes):
    text = yaml.safe_dump(merged(merged(CONFIG, {"link": {"endpoint": endpoint}}), changes))
    return parse(text, "test", Config)


def _own_clock():
    """The steps only pace the flight: a hostile vehicle's clock is not taken for ours."""
    return patch.object(link, "VehicleClock", lambda **_: VehicleClock())


def _flown(summary, autopilot, config):
    events = "; ".join(text for _, text in summary.events)
    return Flown(summary.result, events, autopilot, config)
