"""The table of docs/serve.md by MAVSDK, in real time: `python -m tests.serve.circle_by_mavsdk`.

One program of MAVSDK (`mavsdk_native.py`, or the one that is named before the autopilots) flies a
circle of 5 m at 5 m/s, 50 setpoints a second. Directly means that `serve` passes the setpoints on
(`serve.control: false`), so the mock autopilot flies them itself. On a busy computer begin it with
`chrt -f 50`.
"""

import contextlib
import sys
import tempfile
import threading
from pathlib import Path

from pymavlink import mavutil

from companion.files import bounded_yaml
from tests.serve.circle_table import WINDS
from tests.serve.serving import ROOT, TruthLog, free_ports, mock, serving
from tests.serve.test_stations import flying, report_of

_SECONDS = 200.0


@contextlib.contextmanager
def station(port):
    """A ground station that asks for telemetry: ArduPilot sends none by itself."""
    over = threading.Event()
    link = mavutil.mavlink_connection(f"udpout:127.0.0.1:{port}", source_system=254)

    def ask():
        while not over.wait(2.0):
            link.mav.request_data_stream_send(1, 1, 0, 20, 1)

    thread = threading.Thread(target=ask, daemon=True)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()
        link.close()


def circle_rms(program, autopilot, wind, *, direct):
    """RMS of the horizontal distance from the setpoints at full speed: true, by telemetry, m."""
    vehicle, port, control = free_ports(3)
    config = f"configs/mock-{autopilot}.yaml"
    section = bounded_yaml.parse((ROOT / config).read_text("utf-8"))["mock"]
    with tempfile.TemporaryDirectory() as folder, contextlib.ExitStack() as stack:
        blown = Path(folder) / "mock.yaml"
        blown.write_text(bounded_yaml.dump({"mock": section | {"wind": WINDS[wind]}}))
        stack.enter_context(mock(vehicle, "--config", blown, "--control-port", control))
        settings = ["limits.max_tilt_deg=45", f"recording.directory={folder}"]
        settings += ["recording.report=false", f"serve.control={str(not direct).lower()}"]
        us = serving(vehicle, f"udpin://127.0.0.1:{port}", config=config, settings=settings)
        stack.enter_context(us)
        if direct:
            stack.enter_context(station(port))
        truth = stack.enter_context(TruthLog(control))
        endpoint = f"udpout://127.0.0.1:{port}"
        run = stack.enter_context(flying(program, endpoint, autopilot, "circle"))
        report = report_of(run, _SECONDS)
    return truth.rms(report["wanted"]), report["circle_rms_m"]


def main():
    program, *only = sys.argv[1:] or ("mavsdk_native.py",)
    print("| true (by telemetry) | direct | through us |\n|---|---|---|")
    for autopilot, name in (("px4", "PX4"), ("ardupilot", "ArduPilot")):
        if only and autopilot not in only:
            continue
        for wind in WINDS:
            cells = [
                "{:.3f} m ({:.3f} m)".format(*circle_rms(program, autopilot, wind, direct=direct))
                for direct in (True, False)
            ]
            print(f"| {name}, {wind} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
