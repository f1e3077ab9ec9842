"""What recording and an open live page cost the time from sample to setpoint; flown in real time.

`python -m tests.live.latency --seconds 60 --rounds 2` hovers at 250 Hz in turn without records and
page, and with both and headless Chromium at the page. It prints p50 and p99 of both, their ratio,
and the growth of memory. It needs a computer with nothing else to do.
"""

import argparse
import json
import tempfile
import threading
from contextlib import ExitStack
from pathlib import Path

import numpy as np
import psutil

from companion import demo
from companion.config.files import changed, load, shipped
from companion.flight.observer import SilentObserver, decline_landing
from companion.flight.session import Session
from companion.live.addresses import open_page_socket
from companion.live.helper import Helper, HelperTasks
from companion.mavlink import loop as link_loop
from tests.live.browser import chromium

_FIRST = 60.0
"""Memory is compared with that after this long, s."""


def main() -> None:
    """Fly and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--rounds", type=int, default=2)
    options = parser.parse_args()
    latencies: dict[str, list[float]] = {"without": [], "with": []}
    memory: list[list[float]] = []
    for _ in range(options.rounds):
        for name, found in latencies.items():
            figures, sizes = _flight(options.seconds, page=name == "with")
            found.extend(figures)
            memory.append(sizes)
    told = {
        name: {"p50": np.percentile(found, 50), "p99": np.percentile(found, 99), "n": len(found)}
        for name, found in latencies.items()
    }
    told["ratio"] = {key: told["with"][key] / told["without"][key] for key in ("p50", "p99")}
    told["memory_growth_mb"] = [round(max(each) - each[0], 2) for each in memory if each]
    print(json.dumps(told))


def _flight(seconds: float, *, page: bool) -> tuple[list[float], list[float]]:
    """Latencies in µs, and the memory of this process after `_FIRST` seconds, MB."""
    path = shipped("mock-px4.yaml")
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        endpoints = stack.enter_context(demo.local_endpoints("udpin://127.0.0.1:1"))
        log = folder / "mock.log"
        stack.enter_context(demo.bundled_vehicle(path, endpoints, log, lockstep=False))
        config = changed(
            load(path),
            {
                "link": {"endpoint": endpoints.program},
                "flight": {"arm": True, "maneuvers": ["hover"]},
                "hover": {"duration_s": seconds},
            },
            "test",
        )
        helper, observer = None, SilentObserver()
        if page:
            page_socket = open_page_socket("127.0.0.1:0")
            helper = observer = Helper(
                HelperTasks(None, config, page_socket, None, True, folder), config
            )
            stack.callback(helper.close, "over")
            page_socket.listening_socket.close()
            tab = stack.enter_context(chromium())()
            tab.open(f"http://127.0.0.1:{page_socket.port}/")
        session = Session(config, folder if page else None, observer, decline_landing)
        flight = session.fly()
        if helper is not None:
            helper.changes, helper.note = session.changes, session.note
            flight = helper.run_while_serving(flight)
        sizes: list[float] = []
        over = threading.Event()
        threading.Thread(target=_measure, args=(sizes, over), daemon=True).start()
        summary = link_loop.run(flight)
        over.set()
        assert summary.result == "ok", summary.result
        if helper is not None:
            print(
                "shown in the browser:",
                tab.run("live.frames().length"),
                "states; dropped:",
                helper.dropped,
            )
        return list(summary.trace.latencies_ns.rows()[:, 0] / 1e3), sizes


def _measure(sizes: list[float], over: threading.Event) -> None:
    if over.wait(_FIRST):
        return
    while not over.wait(1.0):
        sizes.append(psutil.Process().memory_info().rss / 1e6)


if __name__ == "__main__":
    main()
