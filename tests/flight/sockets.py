"""Whole flights over sockets: a mock vehicle in its own process, the companion in this one.

Most flights of the tests are in memory (`fly`). Over sockets fly the basic flight on UDP, TCP and
serial, what needs a process to be stopped or killed or to get a signal, what a terminal shows, what
other programs (MAVSDK, the command line) do, and the clocks and keys that real links have.
"""

import json
import socket
import time
from contextlib import contextmanager
from pathlib import Path

from companion.files import bounded_yaml
from companion.flight.observer import SilentObserver
from companion.flight.session import Session
from companion.mavlink import lockstep
from companion.mavlink.transport.free_port import free_port
from tests.flight.fly import LOOP_HZ, merged, quick_flight, quick_vehicle
from tests.flight.programs import start_mock

lockstep._BUSY_WAIT_S = 0.0  # the cores are busy with other flights

QUICK = {"speed": 20.0, "lockstep": {"patience_s": 0.5}}


class Mock:
    """A running mock vehicle and its control channel."""

    def __init__(self, process, port, control_port, config, in_lockstep, autopilot, rate_hz):
        self.process, self.port, self.config = process, port, config
        self.in_lockstep, self.autopilot, self.rate_hz = in_lockstep, autopilot, rate_hz
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

    def inject(self, fault):
        assert self.ask({"fault": fault}) == {"ok": True}

    def clear_faults(self):
        assert self.ask({"clear": True}) == {"ok": True}

    def take_over(self, mode="POSCTL"):
        self.inject({"kind": "pilot_takeover", "mode": mode})

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
def mock_vehicle(folder: Path, *, in_lockstep=True, autopilot="px4", full_rate=False, **settings):
    """Start a mock on free ports; its words go to `folder`/mock.log."""
    rate_hz = 250.0 if full_rate else float(LOOP_HZ)
    port, control_port = free_port(), free_port()
    config, words = folder / "mock.yaml", folder / "mock.log"
    section = quick_vehicle(autopilot, merged(QUICK, settings), full_rate=full_rate)
    config.write_text(bounded_yaml.dump({"mock": section}))
    arguments = ["--headless", "--config", str(config)]
    arguments += ["--port", str(port), "--control-port", str(control_port)]
    process = start_mock(arguments + ["--lockstep"] * in_lockstep, words)
    try:
        yield Mock(process, port, control_port, config, in_lockstep, autopilot, rate_hz)
    finally:
        process.terminate()
        process.join(10.0)
        assert process.exitcode == 0, words.read_text()


def session_for(mock, folder: Path, observer=None, ask_landing=None, **changes):
    link = {"lockstep": mock.in_lockstep, "attitude_rate_hz": mock.rate_hz}
    link["endpoint"] = f"udpin://127.0.0.1:{mock.port}"
    config = quick_flight(mock.autopilot, changes, **link)
    folder.mkdir(exist_ok=True)
    return Session(config, folder, observer or SilentObserver(), ask_landing or decline)


async def decline():
    return False


def fly(mock, folder: Path, observer=None, ask_landing=None, **changes):
    """One flight in lockstep; returns its summary."""
    session = session_for(mock, folder, observer, ask_landing, **changes)
    return lockstep.run(session.fly())
