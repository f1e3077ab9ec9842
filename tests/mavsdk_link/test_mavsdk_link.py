"""The link by way of MAVSDK, judged by the mock; MAVSDK runs in processes of its own."""

import asyncio
import json
import socket
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import pytest
import yaml
from pymavlink.dialects.v20 import common as dialect

from companion.attitude import BodyRates
from companion.mavlink import loop as link_loop
from companion.mavlink.errors import EndpointError, InvalidSetpoint, LinkError
from companion.mavlink.settings import LinkSettings
from companion.mavlink.transport.free_port import free_port
from tests.flight.fly import QUICK_FLIGHT, merged
from tests.flight.programs import Program
from tests.flight.sockets import mock_vehicle

pytest.importorskip("mavsdk")

from companion.mavsdk_link import MavsdkLink, connection_url

PROGRAM = "tests.mavsdk_link.answering_program"
LIMIT_S = 0.3


class Answering:
    """The program, and how long after something its setpoints end, in s: ours, and the mock's."""

    def __init__(self, mock):
        self.mock, self.began = mock, 0.0
        command = [sys.executable, "-m", PROGRAM, str(mock.port)]
        root = Path(__file__).parents[2]
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, text=True, cwd=root)

    def flows(self):
        enough = self.mock.state()["setpoints"] + 50
        self.mock.until(lambda state: state["setpoints"] > enough)
        self.began = self.mock.state()["time"]

    def gets_into(self, trouble):
        self.process.stdin.write(f"{trouble}\n")
        self.process.stdin.flush()

    def ended_after(self):
        last = self.at(0.7)["last_setpoint"]
        assert self.at(0.85)["last_setpoint"] == last
        return last - self.began

    def at(self, seconds):
        return self.mock.until(lambda state: state["time"] > self.began + seconds)


@pytest.fixture
def answering(tmp_path):
    with mock_vehicle(tmp_path, in_lockstep=False, speed=1.0) as mock:
        program = Answering(mock)
        try:
            yield program
        finally:
            program.process.kill()
            program.process.communicate()


def test_setpoints_end_with_what_they_answer_whatever_the_program_does(answering):
    """One program gets into one trouble after the other: to start one takes a second."""
    answering.flows()
    assert answering.mock.ask({"fault": {"kind": "stop_telemetry", "duration_s": 1.0}})["ok"]
    assert -0.1 < answering.ended_after() < LIMIT_S

    answering.flows()  # again, with the samples
    answering.gets_into("frozen loop")
    assert -0.1 < answering.ended_after() < LIMIT_S

    answering.flows()  # again, with the loop
    answering.gets_into("held interpreter")
    assert -0.1 < answering.ended_after() < LIMIT_S
    answering.flows()  # again, with the interpreter


class Vehicle:
    """A socket that says what a vehicle says, and keeps the frames that come."""

    def __init__(self, port):
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.connect(("127.0.0.1", port))
        self._socket.setblocking(False)
        self._mav = dialect.MAVLink(None, 1, 1)

    def say(self, message):
        self._socket.send(message.pack(self._mav))
        self._mav.seq = (self._mav.seq + 1) & 0xFF

    async def hear(self):
        return await asyncio.get_running_loop().sock_recv(self._socket, 2048)

    def close(self):
        self._socket.close()


async def answer_samples(stamps):
    """A vehicle's samples, answered: the link, what its tap saw, what came to the vehicle."""
    port, tapped, came = free_port(), [], []
    settings = LinkSettings(endpoint=f"udpin://127.0.0.1:{port}")
    async with MavsdkLink(settings, lambda _, frame: tapped.append(frame)) as link:
        link.on_attitude = lambda sample: link.send_setpoint(
            sample.time_boot_ms, BodyRates(0.1, -0.2, 0.3), 0.4
        )
        vehicle = Vehicle(port)
        try:
            vehicle.say(dialect.MAVLink_heartbeat_message(2, 12, 0, 0, 4, 3))
            await link.wait_connected(20.0)
            for stamp in stamps:
                vehicle.say(
                    dialect.MAVLink_attitude_quaternion_message(stamp, 1.0, 0, 0, 0, 0, 0, 0)
                )
                async with asyncio.timeout(20.0):
                    while not came or not is_setpoint(came[-1], stamp):
                        came.append(await vehicle.hear())
            with suppress(TimeoutError):  # what MAVSDK repeats would come after 50 ms
                async with asyncio.timeout(0.3):
                    while True:
                        came.append(await vehicle.hear())
        finally:
            vehicle.close()
        return link.stats, list(tapped), came


def is_setpoint(frame, stamp=None):
    read = frame[7] == dialect.MAVLINK_MSG_ID_SET_ATTITUDE_TARGET
    return read and (stamp is None or int.from_bytes(frame[10:14], "little") == stamp)


def test_each_setpoint_leaves_once_as_the_tap_saw_it_and_with_the_samples_stamp():
    stamps = [1000 + 4 * number for number in range(50)]
    stats, tapped, came = link_loop.run(answer_samples(stamps))
    setpoints = [frame for frame in came if is_setpoint(frame)]
    assert [int.from_bytes(frame[10:14], "little") for frame in setpoints] == stamps
    assert [frame for frame in tapped if is_setpoint(frame)] == setpoints
    # Beside them MAVSDK's own frames come to the vehicle, which are not ours to count.
    ours = [frame for frame in tapped if frame[5:7] == setpoints[0][5:7]]
    assert stats.sent == len(ours)


def test_it_flies_the_same_maneuver(tmp_path):
    with mock_vehicle(tmp_path, in_lockstep=False, speed=2.0) as mock:
        changes = {
            "link": {
                "endpoint": f"udpin://127.0.0.1:{mock.port}",
                "backend": "mavsdk",
                "attitude_rate_hz": 100.0,
                "min_attitude_rate_hz": 10.0,
            },
            "hover": {"duration_s": 1.0},
            "flight": {"takeoff_height_m": 2.0},
            "recording": {"directory": str(tmp_path / "flights"), "report": False},
            # It flies in real time, on a computer that may have other things to do.
            "deadman": {
                "telemetry_stale_ms": 400.0,
                "target_stale_ms": 400.0,
                "position_stale_ms": 800.0,
                "silence_limit_ms": 950.0,
            },
        }
        config = tmp_path / "fly.yaml"
        config.write_text(yaml.safe_dump(merged(QUICK_FLIGHT, changes)))
        process = Program("companion.cli.main", "fly", "--config", config, "--json")
        out, err = process.communicate(timeout=90)
    assert process.returncode == 0, err
    summary = json.loads(out)  # and nothing of MAVSDK's own words
    assert (summary["result"], summary["phase"]) == ("ok", "disarm")
    assert summary["tracking"]["height_rms_m"] < 0.5
    assert summary["link"]["sent"] >= summary["setpoints"] > 100


def test_the_endpoints_are_given_in_its_own_notation():
    assert connection_url("udp://0.0.0.0:14540") == "udpin://0.0.0.0:14540"
    assert connection_url("udpout://10.0.0.2:14550") == "udpout://10.0.0.2:14550"
    assert connection_url("tcp://127.0.0.1:5760") == "tcpout://127.0.0.1:5760"
    assert connection_url("tcpin://0.0.0.0:5760") == "tcpin://0.0.0.0:5760"
    assert connection_url("serial:///dev/ttyAMA0:921600") == "serial:///dev/ttyAMA0:921600"


def opened(endpoint, act=lambda _: None, **settings):
    async def run():
        async with MavsdkLink(LinkSettings(endpoint=endpoint, **settings)) as link:
            return act(link)

    return link_loop.run(run())


def test_what_it_cannot_open_is_one_sentence():
    with pytest.raises(EndpointError, match=r"/dev/none:57600 cannot be opened by MAVSDK: check"):
        opened("serial:///dev/none:57600")


def test_it_refuses_lockstep():
    with pytest.raises(LinkError, match="neither fly in lockstep nor sign"):
        opened("udpin://127.0.0.1:0", lockstep=True)


@pytest.mark.parametrize(
    ("rates", "thrust"),
    [((0.0, float("nan"), 0.0), 0.5), ((1e39, 0.0, 0.0), 0.5), ((0.0, 0.0, 0.0), 1.1)],
)
def test_nothing_that_is_not_finite_or_in_range_gets_to_mavsdk(rates, thrust):
    with pytest.raises(InvalidSetpoint):
        opened(
            f"udpin://127.0.0.1:{free_port()}",
            lambda link: link.send_setpoint(1, BodyRates(*rates), thrust),
        )


def test_before_the_vehicle_is_heard_nothing_is_sent():
    asked = lambda link: link.send_setpoint(1, BodyRates(0.0, 0.0, 0.0), 0.5)  # noqa: E731
    assert opened(f"udpin://127.0.0.1:{free_port()}", asked) is False


def test_after_its_end_nothing_is_given_to_mavsdk():
    """Its library ended the whole process by a segmentation fault."""
    transport = opened("udpout://127.0.0.1:9", lambda link: link._outbox.transport)
    given = []
    transport._mavsdk.pass_received_raw_bytes = given.append
    assert transport.send(bytes(20)) is False
    transport.close()
    assert given == []
