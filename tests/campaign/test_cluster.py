"""A campaign on four worker processes joined by TCP: equal results, whatever is killed meanwhile.

Run it by `python -m pytest -m slow tests/campaign/test_cluster.py`; it takes some minutes.
"""

import os
import re
import shutil
import signal
import subprocess
import sys
import time
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path

import pytest

from companion.campaign import store
from companion.child_process import end_with_parent
from companion.files import bounded_yaml
from tests.campaign.test_campaign_file import CONFIGS
from tests.campaign.test_flights import QUICK

pytestmark = [pytest.mark.slow, pytest.mark.timeout(2000)]

ROOT = Path(__file__).parents[2]
FLIGHTS = 16
SECONDS = 500.0


class Processes:
    """The processes of a test, each in a group of its own.

    Args:
        folder: for what they print.
    """

    def __init__(self, folder):
        self.folder, self.running = folder, {}

    def start(self, name, *arguments, source=ROOT):
        path = self.folder / f"{name}.log"
        with path.open("w") as log:
            self.running[name] = subprocess.Popen(
                [sys.executable, *map(str, arguments)],
                cwd=self.folder,
                env={**os.environ, "PYTHONPATH": str(source), "COLUMNS": "300"},
                stdout=log,
                stderr=subprocess.STDOUT,
                start_new_session=True,
                preexec_fn=partial(end_with_parent, os.getpid()),  # noqa: PLW1509  pytest may be killed, too
            )
        return self.running[name]

    def said(self, name):
        return (self.folder / f"{name}.log").read_text()

    def kill(self, name):
        process = self.running.pop(name)
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()

    def close(self):
        for name in list(self.running):
            self.kill(name)

    def cluster(self, name="scheduler", workers=4):
        """Start a scheduler and workers; returns its address."""
        self.start(name, "-m", "distributed.cli.dask_scheduler", "--port", "0", "--no-dashboard")
        address = await_truth(
            lambda: re.search(r"tcp://[\d.]+:\d+", self.said(name)), "the scheduler's address"
        )[0]
        for number in range(workers):
            self.worker(address, f"worker-{name}-{number}")
        return address

    def worker(self, address, name, source=ROOT):
        module = "distributed.cli.dask_worker"
        self.start(name, "-m", module, address, "--nthreads", "1", "--no-dashboard", source=source)

    def campaign(self, name, *arguments):
        return self.start(name, "-m", "companion", "campaign", *arguments)


def await_truth(found, what):
    end = time.monotonic() + SECONDS
    while not (value := found()):
        assert time.monotonic() < end, what
        time.sleep(0.05)
    return value


@contextmanager
def processes(folder):
    folder.mkdir()
    started = Processes(folder)
    try:
        yield started
    finally:
        started.close()


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    told = {
        "name": "cluster",
        "config": str(CONFIGS / "mock-px4.yaml"),
        "samples": FLIGHTS,
        "set": {**QUICK, "hover.duration_s": 4.0},
        "sweep": {"mock.wind.speed_m_s": {"uniform": [0.0, 4.0]}},
    }
    path = tmp_path_factory.mktemp("file") / "campaign.yaml"
    path.write_text(bounded_yaml.dump(told))
    return path


@pytest.fixture(scope="module")
def local(file, tmp_path_factory):
    """The results of two processes on this computer."""
    folder = tmp_path_factory.mktemp("local")
    with processes(folder / "run") as started:
        client = started.campaign("client", file, "--workers", "2", "--out", folder / "out")
        assert client.wait(SECONDS) == 0, started.said("client")
    table = store.read(folder / "out")
    assert table["case"].to_pylist() == list(range(FLIGHTS))
    return table


def units(out):
    """The files of the results: name, time of writing."""
    return {path.name: path.stat().st_mtime_ns for path in (out / "results").glob("unit-*.parquet")}


def begun(out, count=2):
    """Wait for some units; returns them."""
    return await_truth(lambda: found if len(found := units(out)) >= count else None, "units")


def test_a_killed_worker_costs_its_unit_only(file, local, tmp_path):
    out = tmp_path / "out"
    with processes(tmp_path / "run") as started:
        address = started.cluster()
        client = started.campaign("client", file, "--scheduler", address, "--out", out)
        begun(out)
        started.kill("worker-scheduler-0")
        assert client.wait(SECONDS) == 0, started.said("client")
    assert store.read(out).equals(local)


def test_a_lost_scheduler_and_a_killed_client_lose_nothing_and_repeat_nothing(
    file, local, tmp_path
):
    out = tmp_path / "out"
    with processes(tmp_path / "run") as started:
        address = started.cluster()
        client = started.campaign("first", file, "--scheduler", address, "--out", out)
        kept = begun(out)
        started.kill("scheduler")
        assert client.wait(SECONDS) == 1
        said = started.said("first")
        assert "the connection to the Dask scheduler is lost" in said
        assert f"companion campaign {out} --scheduler {address}" in said
        assert "Traceback" not in said, said
        address = started.cluster("another")
        client = started.campaign("second", out, "--scheduler", address)
        kept = {**kept, **begun(out, len(units(out)) + 2)}
        started.kill("second")
        client = started.campaign("third", out, "--scheduler", address)
        assert client.wait(SECONDS) == 0, started.said("third")
        client = started.campaign("fourth", out, "--scheduler", address)  # nothing is left
        assert client.wait(SECONDS) == 0, started.said("fourth")
    found = units(out)
    assert {name: found[name] for name in kept} == kept
    assert store.read(out).equals(local)


def test_a_worker_of_another_version_is_refused(file, tmp_path):
    other = tmp_path / "other"
    for package in ("companion", "sitl_mock"):
        shutil.copytree(ROOT / package, other / package)
    with (other / "companion" / "attitude" / "exact.py").open("a") as source:
        source.write("# another version\n")
    with processes(tmp_path / "run") as started:
        address = started.cluster(workers=1)
        started.worker(address, "other", source=other)
        await_truth(lambda: "Registered to" in started.said("other"), "the other worker")
        client = started.campaign("client", file, "--scheduler", address)
        assert client.wait(SECONDS) == 2
        said = started.said("client")
    assert re.fullmatch(
        r"companion: the worker tcp://[\d.:]+ has the source of companion \w+ instead of \w+: .*\n",
        said,
    ), said
    assert not (tmp_path / "run" / "runs").exists()


def test_ctrl_c_in_a_terminal_ends_it_without_a_traceback(file, local, tmp_path):
    out = tmp_path / "out"
    with processes(tmp_path / "run") as started:
        client = started.campaign("client", file, "--workers", "2", "--out", out)
        begun(out)
        os.killpg(client.pid, signal.SIGINT)  # a terminal sends it to the workers, too
        assert client.wait(SECONDS) == 1
        said = started.said("client")
        assert f"companion campaign {out}" in said
        assert "Traceback" not in said, said
        client = started.campaign("again", out)
        assert client.wait(SECONDS) == 0, started.said("again")
    assert store.read(out).equals(local)
