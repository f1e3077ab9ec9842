"""The link by way of MAVSDK, judged by the mock; MAVSDK runs in processes of its own."""

import json
import subprocess
import sys

import pytest
import yaml

from companion.attitude import BodyRates
from companion.mavlink import EndpointError, InvalidSetpoint, LinkError, LinkSettings
from companion.mavlink import loop as link_loop
from tests.flight.fly import QUICK_FLIGHT, free_port, merged, mock_vehicle

pytest.importorskip("mavsdk")

from companion.mavsdk_link.connection_url import connection_url
from companion.mavsdk_link.link import MavsdkLink

PROGRAM = "tests.mavsdk_link.answering_program"
LIMIT_S = 0.3


class Answering:
    """The program, and how long after something its setpoints end, in s: ours, and the mock's."""

    def __init__(self, mock):
        self.mock, self.began = mock, 0.0
        command = [sys.executable, "-m", PROGRAM, str(mock.port)]
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, text=True)

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


def test_it_flies_the_same_programme(tmp_path):
    with mock_vehicle(tmp_path, in_lockstep=False, speed=2.0) as mock:
        changes = {
            "link": {
                "endpoint": f"udpin://127.0.0.1:{mock.port}",
                "backend": "mavsdk",
                "attitude_rate_hz": 100.0,
            },
            "hover": {"duration_s": 1.0},
            "flight": {"takeoff_height_m": 2.0},
            "recording": {"directory": str(tmp_path / "flights")},
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
        command = [sys.executable, "-m", "companion", "fly", "--config", str(config), "--json"]
        done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=90)
    assert done.returncode == 0, done.stderr
    summary = json.loads(done.stdout)  # and nothing of MAVSDK's own words
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
    [((0.0, float("nan"), 0.0), 0.5), ((1e38, 0.0, 0.0), 0.5), ((0.0, 0.0, 0.0), 1.1)],
)
def test_nothing_that_is_not_finite_or_in_range_gets_to_mavsdk(rates, thrust):
    """1e38 rad/s is a float32, but in degrees, as MAVSDK takes it, it is not."""
    with pytest.raises(InvalidSetpoint):
        opened(
            f"udpin://127.0.0.1:{free_port()}",
            lambda link: link.send_setpoint(1, BodyRates(*rates), thrust),
        )


def test_before_the_vehicle_is_known_nothing_is_sent():
    asked = lambda link: link.send_setpoint(1, BodyRates(0.0, 0.0, 0.0), 0.5)  # noqa: E731
    assert opened(f"udpin://127.0.0.1:{free_port()}", asked) is False
