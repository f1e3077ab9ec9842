"""Whole flights for the tests: a mock vehicle in its own process, the companion in this one."""

import json
import socket
import time
from contextlib import contextmanager
from pathlib import Path

from companion.config import Config
from companion.demo import free_port
from companion.files import bounded_yaml
from companion.files.yaml_file import parse
from companion.flight.observer import Silent
from companion.flight.session import Session
from companion.mavlink import lockstep
from tests.flight import mock_start

lockstep._SPIN_S = 0.0  # the cores are busy with other flights

CONFIGS = Path(__file__).parents[2] / "configs"

QUICK_MOCK = {
    "gcs_port": 0,
    "prearm_delay_s": 0.2,
    "speed": 20.0,
    "lockstep": {"patience_s": 0.5},
}
QUICK_PARAMETERS = {
    "px4": {
        "MPC_TKO_RAMP_T": 0.3,
        "COM_SPOOLUP_TIME": 0.1,
        "MPC_TKO_SPEED": 3.0,
        "MPC_LAND_SPEED": 3.0,
        "MPC_LAND_CRWL": 1.5,
        "MPC_LAND_ALT1": 2.0,
        "MPC_LAND_ALT2": 1.0,
        "MPC_Z_V_AUTO_DN": 3.0,
        "COM_DISARM_LAND": 0.2,
    },
    "ardupilot": {
        "GUID_OPTIONS": 8,
        "ATC_ANGLE_BOOST": 0,
        "GUID_TIMEOUT": 1.0,
        "LAND_SPEED": 150.0,
        "WPNAV_SPEED_DN": 300.0,
        "WPNAV_ACCEL_Z": 300.0,
    },
}
QUICK_FLIGHT = {
    "flight": {"arm": True, "takeoff_height_m": 2.0, "maneuvers": ["hover"]},
    "hover": {"duration_s": 5.0},
    "guidance": {"drag_per_s": 1.0},
    "thrust": {"hover_thrust": 0.49},
}
OTHER_VEHICLES = {
    "ardupilot": {
        "guidance": {"drag_per_s": 0.25, "quadratic_drag_per_m": 0.033},
        "thrust": {"hover_thrust": 0.364},
    },
}


def merged(base, changes):
    out = dict(base)
    for key, value in changes.items():
        out[key] = merged(out.get(key, {}), value) if isinstance(value, dict) else value
    return out


class Mock:
    """A running mock vehicle and its control channel."""

    def __init__(self, process, port, control_port, config, in_lockstep, autopilot):
        self.process, self.port, self.config = process, port, config
        self.in_lockstep, self.autopilot = in_lockstep, autopilot
        self._address = ("127.0.0.1", control_port)

    def ask(self, request):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as channel:
            channel.settimeout(0.1)
            for _ in range(100):  # it may not have started yet
                try:
                    channel.sendto(json.dumps(request).encode(), self._address)
                    return json.loads(channel.recv(65536))
                except (TimeoutError, ConnectionRefusedError):
                    assert self.process.is_alive(), "the mock vehicle stopped"
        raise AssertionError("the mock vehicle does not answer")

    def state(self):
        return self.ask({"state": True})

    def until(self, condition, seconds=20.0):
        """Wait (wall time) until the vehicle's true state satisfies `condition`."""
        deadline = time.monotonic() + seconds
        while not condition(state := self.state()):
            assert time.monotonic() < deadline, f"still {state}"
            time.sleep(0.02)
        return state


@contextmanager
def mock_vehicle(folder: Path, *, in_lockstep=True, autopilot="px4", **settings):
    """Start a mock on free ports; its words go to `folder`/mock.log."""
    port, control_port = free_port(), free_port()
    config, words = folder / "mock.yaml", folder / "mock.log"
    quick = {**QUICK_MOCK, "autopilot": autopilot, "parameters": QUICK_PARAMETERS[autopilot]}
    config.write_text(bounded_yaml.dump({"mock": merged(quick, settings)}))
    arguments = ["--headless", "--config", str(config)]
    arguments += ["--port", str(port), "--control-port", str(control_port)]
    process = mock_start.start(arguments + ["--lockstep"] * in_lockstep, words)
    try:
        yield Mock(process, port, control_port, config, in_lockstep, autopilot)
    finally:
        process.terminate()
        process.join(10.0)
        assert process.exitcode == 0, words.read_text()


def session_for(mock, folder: Path, observer=None, ask_landing=None, **changes):
    link = {"endpoint": f"udpin://127.0.0.1:{mock.port}", "lockstep": mock.in_lockstep}
    flight = merged(QUICK_FLIGHT, OTHER_VEHICLES.get(mock.autopilot, {}))
    text = bounded_yaml.dump(merged(merged(flight, {"link": link}), changes))
    folder.mkdir(exist_ok=True)
    return Session(
        parse(text, "test", Config), folder, observer or Silent(), ask_landing or decline
    )


async def decline():
    return False


def fly(mock, folder: Path, observer=None, ask_landing=None, **changes):
    """One flight in lockstep; returns its summary."""
    session = session_for(mock, folder, observer, ask_landing, **changes)
    return lockstep.run(session.fly())
