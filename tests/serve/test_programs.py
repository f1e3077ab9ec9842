"""Programs that no one here wrote, through `companion serve`: MAVSDK and MAVProxy at once."""

import json
import shutil
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from tests.serve.serving import free_ports, mock, serving

MAVSDK = Path(__file__).with_name("mavsdk_program.py")
PARAMETERS = 90
PLAN = """QGC WPL 110
0\t1\t0\t16\t0\t0\t0\t0\t47.3977418\t8.5455939\t488.0\t1
1\t0\t3\t22\t0\t0\t0\t0\t47.3977418\t8.5455939\t10.0\t1
2\t0\t3\t16\t0\t0\t0\t0\t47.3978000\t8.5456000\t10.0\t1
"""


@pytest.mark.timeout(180)
def test_mavsdk_flies_by_setpoints_and_mavproxy_uploads_a_mission_and_wins(tmp_path):
    vehicle, station, program = free_ports(3)
    endpoints = f"udpout://127.0.0.1:{station}", f"udpin://127.0.0.1:{program}"
    settings = [f"recording.directory={tmp_path / 'flights'}"]
    with (
        mock(vehicle),
        serving(vehicle, *endpoints, settings=settings) as served,
        mavproxy(station, tmp_path) as proxy,
        subprocess.Popen(
            [sys.executable, MAVSDK, f"udpout://127.0.0.1:{program}"],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        ) as run,
    ):  # fmt: skip
        received = received_parameters(proxy)
        assert run.stdout.readline() == "IN CONTROL\n", run.communicate()[1]
        upload_a_mission(proxy, tmp_path)
        proxy.stdin.write("long DO_SET_MODE 1 4 5\n")
        read_until(proxy, "Mode RTL")
        out, errors = run.communicate(timeout=60)
        assert run.returncode == 0, out + errors
    report = json.loads(out.split("REPORT ")[1].splitlines()[0])
    assert report["mission"] == 3
    assert report["lost_to"] == "RETURN_TO_LAUNCH"
    assert "took over: mode AUTO.RTL" in served.said
    assert received >= PARAMETERS
    (page,) = tmp_path.glob("flights/*/report.html")
    assert f"Report: {page}" in "".join(served.said.split("\n"))
    counters = served.counters
    assert counters["routing"]["looped"] == counters["uplink"]["dropped"] == 0
    assert {each["dropped"] for each in counters["clients"].values()} == {0}


class mavproxy:  # noqa: N801 - a context manager
    """MAVProxy, listening on a UDP port; killed if the test hangs."""

    def __init__(self, port, folder):
        script = shutil.which("mavproxy.py", path=Path(sys.executable).parent)
        assert script, "MAVProxy is not installed beside this Python"
        self._process = subprocess.Popen(
            [sys.executable, script, f"--master=udpin:127.0.0.1:{port}",
             "--default-modules=param,mode,arm,cmdlong,wp", f"--state-basedir={folder}"],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
            text=True, bufsize=1, cwd=folder,
        )  # fmt: skip
        self._watchdog = threading.Timer(250.0, self._process.kill)

    def __enter__(self):
        self._watchdog.start()
        return self._process

    def __exit__(self, *_):
        self._watchdog.cancel()
        self._process.kill()
        self._process.communicate()


def received_parameters(proxy):
    """How many parameters MAVProxy has received."""
    said = read_until(proxy, "parameters\n")
    return next(int(word) for word in said.split("Received ")[1].split() if word.isdigit())


def upload_a_mission(proxy, folder):
    (folder / "plan.txt").write_text(PLAN)
    proxy.stdin.write(f"wp load {folder / 'plan.txt'}\n")
    read_until(proxy, "MISSION_ACK: TYPE_MISSION: ACCEPTED")


def read_until(process, words):
    """Return what the process says up to the line that contains the words."""
    said = ""
    while words not in said:
        line = process.stdout.readline()
        assert line, f"MAVProxy ended before it said {words!r}:\n{said}"
        said += line
    return said
