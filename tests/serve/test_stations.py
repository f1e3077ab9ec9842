"""MAVSDK's two packages fly every kind of setpoint through us, and MAVProxy takes the vehicle."""

import importlib.util
import json
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.serve.serving import TruthLog, free_ports, mock, serving
from tests.serve.test_programs import mavproxy, read_until, received_parameters, upload_a_mission

HOVER_AND_PARAMETER = {
    "px4": ("0.49", "MPC_THR_HOVER"),
    "ardupilot": ("0.364", "MOT_THST_HOVER"),
}
PROGRAMS = {"mavsdk_native.py": "mavsdk", "mavsdk_grpc_program.py": "mavsdk_grpc"}
LEAST_PARAMETERS = {"px4": 90, "ardupilot": 40}
LARGEST_RMS = {"px4": 0.10, "ardupilot": 0.13}
"""Of the true distance, m; ArduPilot's estimate alone is off by 0.10 on such a circle."""
LOITER = {"px4": "long DO_SET_MODE 1 4 3\n", "ardupilot": "long DO_SET_MODE 1 5\n"}


@contextmanager
def flying(program, endpoint, autopilot, *how):
    """An offboard program of MAVSDK; killed if the test fails meanwhile."""
    run = subprocess.Popen(
        [sys.executable, Path(__file__).with_name(program), endpoint,
         *HOVER_AND_PARAMETER[autopilot], *how],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    try:
        yield run
    finally:
        run.kill()
        run.communicate()


def report_of(run, seconds):
    """What a program reports at its end."""
    out, errors = run.communicate(timeout=seconds)
    assert run.returncode == 0, out + errors
    return json.loads(out.split("REPORT ")[1].splitlines()[0])


def take_it(proxy, autopilot):
    proxy.stdin.write(LOITER[autopilot])
    read_until(proxy, "Mode LOITER")


def check_flown(report, said):
    """What a program has seen that flew every kind of setpoint."""
    for flag in ("armable", "active", "still_active", "regained", "disarmed"):
        assert report[flag], (flag, said)
    assert 0.0 < report["parameter"] < 1.0
    assert report["start_s"] < 5.0
    assert report["position"] < 0.2
    assert report["back"] < 0.3
    assert report["place"] < 0.3
    assert report["velocity"] == pytest.approx(-1.5, abs=0.2)
    assert report["position_velocity"] < 0.3
    assert report["acceleration"] == pytest.approx(1.0, abs=0.3)


@pytest.mark.slow
@pytest.mark.timeout(300)
@pytest.mark.parametrize("program", PROGRAMS)
@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
def test_mavsdk_flies_every_setpoint_while_mavproxy_reads_uploads_and_wins(
    autopilot, program, tmp_path
):
    """From the ground and back in real time, with a circle of 5 m at 5 m/s."""
    if importlib.util.find_spec(PROGRAMS[program]) is None:
        pytest.skip(f"{PROGRAMS[program]} is not installed: pip install 'mavlink-companion[test]'")
    vehicle, station, port, control = free_ports(4)
    config = f"configs/mock-{autopilot}.yaml"
    endpoints = f"udpout://127.0.0.1:{station}", f"udpin://127.0.0.1:{port}"
    settings = ["limits.max_tilt_deg=45", "recording.report=false"]
    settings += [f"recording.directory={tmp_path / 'flights'}"]
    with (
        mock(vehicle, "--config", config, "--control-port", control),
        serving(vehicle, *endpoints, config=config, settings=settings) as served,
        mavproxy(station, tmp_path) as proxy,
        TruthLog(control) as truth,
        flying(program, f"udpout://127.0.0.1:{port}", autopilot, "loses") as run,
    ):
        assert received_parameters(proxy) >= LEAST_PARAMETERS[autopilot]
        upload_a_mission(proxy, tmp_path)
        assert run.stdout.readline() == "TAKE IT\n", run.communicate()
        take_it(proxy, autopilot)
        report = report_of(run, 90.0)

    check_flown(report, served.said)
    assert truth.rms(report["wanted"]) <= LARGEST_RMS[autopilot]
    assert not truth.crashed
    assert served.said.count("took over: mode") == 1, "by MAVProxy"
    assert served.said.count("commanded mode") == 1, "by the program, to land"
    counters = served.counters
    assert counters["routing"]["looped"] == counters["uplink"]["dropped"] == 0
    assert len(list(tmp_path.glob("flights/*/summary.json"))) == 2
