"""Flies the companion against a hostile autopilot, and holds every flight to the same rules."""

import socket
from typing import NamedTuple
from unittest.mock import patch

import yaml

from companion.config import Config
from companion.files.yaml_file import parse
from companion.flight.observer import Silent
from companion.flight.session import Session
from companion.mavlink import lockstep
from companion.vehicle import link
from companion.vehicle.clock import VehicleClock
from tests.flight.fly import merged
from tests.flight.sockets import decline
from tests.hostile.autopilot import HostileAutopilot
from tests.hostile.body import HOVER_THRUST

lockstep._SPIN_S = 0.0  # the cores are busy with other flights

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
        "ready_timeout_s": 8.0,
        "arming_timeout_s": 6.0,
        "takeoff_timeout_s": 8.0,
        "landing_timeout_s": 10.0,
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


def fly(kind, script, folder, *, mode=None, prepare=None, **changes):
    """One flight; `prepare` may change the autopilot before it starts."""
    port = _free_port()
    autopilot = HostileAutopilot(kind, port, script, mode)
    if prepare is not None:
        prepare(autopilot)
    endpoint = {"link": {"endpoint": f"udpin://127.0.0.1:{port}"}}
    text = yaml.safe_dump(merged(merged(CONFIG, endpoint), changes))
    config = parse(text, "test", Config)
    session = Session(config, folder, Silent(), decline)
    autopilot.start()
    try:
        # The steps only pace the flight: a hostile vehicle's clock is not taken for ours.
        with patch.object(link, "VehicleClock", lambda **_: VehicleClock()):
            summary = lockstep.run(session.fly())
    finally:
        autopilot.end()
    events = "; ".join(text for _, text in summary.events)
    return Flown(summary.result, events, autopilot, config)


def _free_port():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]
