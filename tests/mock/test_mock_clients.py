"""Clients that no one here wrote must be satisfied: MAVSDK and MAVProxy, as real processes."""

import json
import shutil
import subprocess
import sys
import threading
from pathlib import Path

from mock_process import Client, ask, free_port, mock_process

PROGRAM = Path(__file__).with_name("mavsdk_program.py")
PARAMETERS = 90


def test_an_official_mavsdk_program_flies_by_rates():
    port = free_port()
    with mock_process("--port", port, "--gcs-port", 0, "--speed", 3):
        run = subprocess.run(
            [sys.executable, PROGRAM, str(port)],
            capture_output=True, text=True, timeout=40, check=False,
        )  # fmt: skip
    assert run.returncode == 0, run.stdout + run.stderr
    report = json.loads(run.stdout.split("REPORT ")[1].splitlines()[0])
    assert report == {
        "takeoff_altitude": 3.0, "offboard": True, "turned": True, "disarmed": True,
    }  # fmt: skip


def test_mavproxy_fetches_all_parameters_and_changes_the_mode(tmp_path):
    mavproxy = shutil.which("mavproxy.py", path=Path(sys.executable).parent)
    assert mavproxy, "MAVProxy is not installed beside this Python"
    port, control = free_port(), free_port()
    with mock_process("--port", port, "--gcs-port", 0, "--control-port", control):
        client = subprocess.Popen(
            [sys.executable, mavproxy, f"--master=udpin:127.0.0.1:{port}",
             "--default-modules=param,mode,arm,cmdlong", f"--state-basedir={tmp_path}"],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
            text=True, bufsize=1, cwd=tmp_path,
        )  # fmt: skip
        watchdog = threading.Timer(35.0, client.kill)
        watchdog.start()
        try:
            said = read_until(client, "parameters\n")
            assert f"Received {listed(said)} parameters" in said
            assert listed(said) >= PARAMETERS
            # MAVProxy's own `mode NAME` raises a TypeError for every PX4 (1.8.75).
            client.stdin.write("long DO_SET_MODE 1 4 6\n")
            read_until(client, "Mode LAND")
            assert ask(control, {"state": True})["mode"] == "LAND"
            client.stdin.write("param set MIS_TAKEOFF_ALT 4.5\n")
            for _ in range(50):  # it sends the new value some time after the command
                client.stdin.write("param fetch MIS_TAKEOFF_ALT\n")
                if "MIS_TAKEOFF_ALT = 4.5" in read_until(client, "MIS_TAKEOFF_ALT = "):
                    break
            else:
                raise AssertionError("the parameter was not set")
        finally:
            watchdog.cancel()
            client.kill()
            client.communicate()


def read_until(process, words):
    """Return what the process says up to the line that contains the words."""
    said = ""
    while words not in said:
        line = process.stdout.readline()
        assert line, f"MAVProxy ended before it said {words!r}:\n{said}"
        said += line
    return said


def listed(said):
    return next(int(word) for word in said.split("Received ")[1].split() if word.isdigit())


def test_the_telemetry_a_client_meets_before_it_speaks():
    port = free_port()
    with Client(port) as client, mock_process("--port", port, "--gcs-port", 0):
        heartbeat = client.wait_for("HEARTBEAT")
    assert (heartbeat.type, heartbeat.autopilot, heartbeat.base_mode) == (2, 12, 29)
