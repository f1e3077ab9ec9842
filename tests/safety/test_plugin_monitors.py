"""Monitors of another package: they run beside ours, and none can stop or soften the others."""

import importlib
import socket
import sys
from importlib import invalidate_caches
from threading import Event, Thread

import pytest

from companion.cli.main import main
from companion.config import Config
from companion.files.yaml_file import ConfigError
from companion.flight.observer import SilentObserver
from companion.recording.closing_words import closing_words
from companion.safety import Action, SafetyLadder, monitors
from companion.safety.actions import StreamEffect
from companion.safety.snapshot import AutopilotStatus, Motion, Snapshot
from companion.testing import fly
from tests.flight.fly import QUICK_FLIGHT, QuickVehicle, merged
from tests.test_extending import block

CODE = """

import asyncio
import sys
from companion.safety.actions import StreamEffect

def made(config, check, action=Action.WARN, **rest):
    return Monitor("theirs", check, action, **rest)

def high(config):
    def check(snapshot, raised):
        height = snapshot.motion.height
        if height is not None and height > 1.0:
            raise ArithmeticError("too thin an air")
    return made(config, check)

def leaving(config):
    def check(snapshot, raised):
        if snapshot.motion.height is not None and snapshot.motion.height > 1.0:
            sys.exit(1)
    return made(config, check)

def blocking(config):
    times = [1.5]
    def check(snapshot, raised):
        if times and snapshot.motion.height is not None and snapshot.motion.height > 1.0:
            asyncio.get_running_loop().clock.now += times.pop()
    return made(config, check)

def silent(config):
    return made(config, lambda snapshot, raised: None, stream=StreamEffect.STOPS_AT_ONCE)

def slow(config):
    return made(config, lambda snapshot, raised: wait())

def wait():
    pass

def raising(config):
    return made(config, lambda snapshot, raised: snapshot.motion.height + 1.0)

def counting(config):
    return made(config, lambda snapshot, raised: 5)

def wordless(config):
    return made(config, lambda snapshot, raised: "")

def releasing(config):
    return made(config, lambda snapshot, raised: None, Action.RELEASE)

def unmade(config):
    raise OSError("no file")

def nothing(config):
    return None
"""
NAMES = ("sinking", "high", "leaving", "blocking", "silent", "slow", "raising", "counting",
         "wordless", "releasing", "unmade", "nothing")  # fmt: skip
LEVEL = (1.0, 0.0, 0.0, 0.0)


@pytest.fixture(autouse=True)
def installed(tmp_path, monkeypatch):
    """A package with the monitor of docs/extending.md and others, installed as pip does."""
    (tmp_path / "my_monitors.py").write_text(block("my_monitors.py") + CODE, "utf-8")
    (tmp_path / "my_rangefinder.py").write_text(block("my_rangefinder.py"), "utf-8")
    info = tmp_path / "my_monitors-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: my-monitors\nVersion: 1.0\n")
    entries = "".join(f"{name} = my_monitors:{name}\n" for name in NAMES)
    entries += "rangefinder = my_rangefinder:rangefinder\n"
    (info / "entry_points.txt").write_text(f"[companion.monitors]\n{entries}")
    monkeypatch.syspath_prepend(tmp_path)
    invalidate_caches()
    yield
    sys.modules.pop("my_monitors", None)
    sys.modules.pop("my_rangefinder", None)


def configured(*names):
    return Config(safety={"monitors": names})


def test_the_rangefinder_of_the_page_lands_the_vehicle_and_the_words_name_it():
    rangefinder = importlib.import_module("my_rangefinder")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        rangefinder.PORT = free.getsockname()[1]
    distance, ended = [b"5.0"], Event()

    def send():
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            while not ended.wait(0.01):
                sender.sendto(distance[0], ("127.0.0.1", rangefinder.PORT))

    class Near(SilentObserver):
        def phase(self, name, waits_for):
            if name == "maneuvers":
                distance[0] = b"1.2"

    Thread(target=send).start()
    long = {"hover": {"duration_s": 60.0}, "safety": {"monitors": ["rangefinder"]}}
    vehicle = QuickVehicle("px4")
    try:
        summary = fly(merged(QUICK_FLIGHT, long), vehicle, observer=Near())
    finally:
        ended.set()
    assert (summary.result, summary.phase) == ("an obstacle is 1.2 m away", "maneuvers")
    assert vehicle.state()["armed"] is False
    told = closing_words(summary.as_dict(), None)
    assert "  what to do: fix what your own monitor `rangefinder` reported" in "\n".join(told.lines)


def test_the_monitor_of_the_page_flies_and_raises_its_alarm():
    config = merged(QUICK_FLIGHT, {"safety": {"monitors": ["sinking"]}})
    summary = fly(config, QuickVehicle("px4"))
    assert summary.result == "ok", summary.events
    ladder = SafetyLadder(monitors(configured("sinking")), 3.0)
    moving = Snapshot(10.0, motion=Motion(LEVEL, velocity=(0.0, 0.0, 2.5), height=5.0))
    ladder.step(moving)
    ladder.step(moving._replace(now=10.31))
    assert "sinking" in ladder.raised_alarms
    assert ladder.breaches["the vehicle sinks at 2.5 m/s"] == "sinking"


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
@pytest.mark.parametrize(
    ("name", "raised", "line"),
    [
        ("high", "ArithmeticError: too thin an air", 'raise ArithmeticError("too thin an air")'),
        ("leaving", "SystemExit: 1", "sys.exit(1)"),
    ],
)
def test_a_judge_that_raises_hands_the_vehicle_back_and_is_named(autopilot, name, raised, line):
    vehicle = QuickVehicle(autopilot)
    config = merged(QUICK_FLIGHT, {"safety": {"monitors": [name, "silent"]}})
    summary = fly(config, vehicle)
    path = sys.modules["my_monitors"].__file__
    code = (block("my_monitors.py") + CODE).splitlines()
    number = next(k for k, text in enumerate(code, 1) if text.strip() == line)
    assert summary.result == (
        f"an error outside this program: the check {name}.<locals>.check of the module my_monitors "
        f"raised {raised} ({path}:{number}); the vehicle is handed back"
    )
    assert vehicle.state()["mode"] == {"px4": "LOITER", "ardupilot": "BRAKE"}[autopilot]
    assert not vehicle.state()["crashed"]
    assert not any("internal error" in text for _, text in summary.events)


def test_a_judge_that_blocks_is_not_taken_for_a_silent_vehicle():
    vehicle = QuickVehicle("ardupilot", lockstep=False, delay_s=0.015)
    config = merged(QUICK_FLIGHT, {"safety": {"monitors": ["blocking"]}})
    summary = fly(config, vehicle)
    assert summary.result.startswith("this program did not run for 1.5 s"), summary.events
    assert vehicle.state()["mode"] == "BRAKE"


def test_a_judge_that_raises_is_asked_once_and_stops_no_other_monitor():
    ladder = SafetyLadder(monitors(configured("high")), 3.0)
    rolled = Snapshot(
        10.0, AutopilotStatus(armed=False), Motion((0.0, 1.0, 0.0, 0.0), height=9.0)
    )  # upside down and disarmed
    ladder.step(rolled)
    assert {"high (error)", "disarmed"} <= set(ladder.raised_alarms)
    ladder.step(rolled._replace(now=10.5))
    assert "tilt" in ladder.raised_alarms


def test_a_judge_that_is_always_slow_is_named_in_a_warning(monkeypatch):
    clock = [0.0]
    monkeypatch.setattr("companion.safety.plugin_monitors.perf_counter", lambda: clock[0])
    ladder = SafetyLadder(monitors(configured("slow")), 3.0)
    notes = []
    ladder.note = notes.append
    sys.modules["my_monitors"].wait = lambda: clock.__setitem__(0, clock[0] + taken)
    for step in range(60):  # of 20 ms; every fifth answer is quick at first
        taken = 0.001 if step < 30 and step % 5 == 0 else 0.015
        ladder.step(Snapshot(10.0 + 0.02 * step))
        assert ("slow (too slow)" in ladder.raised_alarms) is (step >= 51)
    assert notes[-1] == (
        "safety: slow (too slow): this monitor takes 15 ms, and delays the setpoints → warn"
    )


def test_a_judge_that_raised_is_not_called_slow(monkeypatch):
    clock = iter((0.0, 0.001, 1.0, 1.015))
    monkeypatch.setattr("companion.safety.plugin_monitors.perf_counter", lambda: next(clock))
    ladder = SafetyLadder(monitors(configured("high")), 3.0)
    for step in range(60):
        ladder.step(Snapshot(10.0 + 0.02 * step, motion=Motion(height=9.0)))
    assert "high (error)" in ladder.raised_alarms
    assert "high (too slow)" not in ladder.raised_alarms


def test_it_can_only_choose_among_the_actions():
    (row,) = (each for each in monitors(configured("silent")) if each.name == "silent")
    assert (row.action, row.stream) == (Action.WARN, StreamEffect.CONTINUES)
    ours = monitors(Config())
    beside = monitors(configured("silent"))[: len(ours)]
    assert [each.name for each in beside] == [each.name for each in ours]


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("raising", "accept a snapshot whose values are None: .* raised TypeError: unsupported"),
        ("counting", "it returned 5, which is neither a text nor None"),
        ("wordless", "it returned '', which is neither a text nor None"),
        ("releasing", "`action` must be WARN, HOLD, HAND_BACK or LAND"),
        ("unmade", "the monitor unmade of the module my_monitors raised OSError: no file"),
        ("nothing", "must make a companion.safety.monitor.Monitor, not None"),
        ("sinkin", "unknown monitor 'sinkin'; known: .*; did you mean sinking?"),
    ],
)
def test_what_cannot_watch_is_refused_before_the_vehicle_is_asked(name, why, tmp_path, capsys):
    path = tmp_path / "c.yaml"
    path.write_text(f"safety: {{monitors: [{name}]}}")
    assert main(["check-config", str(path)]) == 2
    error = " ".join(capsys.readouterr().err.split())
    with pytest.raises(AssertionError, match=why):
        raise AssertionError(error)


def test_an_unknown_monitor_is_a_config_error():
    with pytest.raises(ConfigError, match="unknown monitor 'none'"):
        configured("none")
