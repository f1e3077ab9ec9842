"""What a signal means; that none costs the vehicle its hold, or the flight its record."""

import asyncio
import json
import os
import pty
import signal
import subprocess
import sys

import pytest
import yaml

from companion.cli.signals import HOW_TO_LEAVE, SignalHandler, fly_interruptibly
from companion.mavlink import lockstep
from companion.recording.flight_record import read_flight
from companion.vehicle.link import Link
from tests.flight.fly import QUICK_FLIGHT, merged
from tests.flight.others import When
from tests.flight.sockets import mock_vehicle, session_for

INT, TERM, HUP = signal.SIGINT, signal.SIGTERM, signal.SIGHUP
LANDS_ALONE = {"COM_OBL_RC_ACT": 4}  # so that what holds was handed back


class Asked:
    """Stands in for a session; notes what is asked of it."""

    def __init__(self, flies=True):
        self.flies, self.asked = flies, []

    def interrupt(self, reason):
        self.asked.append(reason.removeprefix("interrupted by "))
        return self.flies

    def leave(self):
        self.asked.append("leave")

    def note(self, text):
        assert text == HOW_TO_LEAVE

    def give_up(self):
        self.asked.append("give up")


def asked(*signals, flies=True):
    """What comes of signals, given as (when in s, which)."""
    session, now = Asked(flies), 0.0
    judge = SignalHandler(session, session.give_up, lambda: now)
    for now, number in signals:  # noqa: B007 - the clock reads it
        judge.handle(number)
    return session.asked


USER, LOST = "the user (Ctrl-C)", "SIGHUP (the terminal went away)"


@pytest.mark.parametrize(
    ("signals", "comes"),
    [
        ([(5.0, INT)], [USER]),
        ([(5.0, INT), (6.0, INT)], [USER, "leave"]),
        ([(5.0, INT), (5.1, INT), (5.9, INT)], [USER]),
        ([(5.0 + 0.03 * n, INT) for n in range(100)], [USER]),  # held down
        ([(5.0, INT), (5.5, INT), (6.4, INT), (7.4, INT)], [USER, "leave"]),
        ([(5.0, HUP), (5.0003, HUP), (9.0, HUP)], [LOST] * 3),
        ([(5.0, HUP), (5.0003, TERM), (9.0, TERM)], [LOST, "SIGTERM", "SIGTERM"]),
        ([(5.0, TERM), (9.0, INT)], ["SIGTERM", USER]),
        ([(5.0, INT), (9.0, HUP)], [USER, LOST]),
    ],
)
def test_only_a_ctrl_c_after_a_ctrl_c_leaves_and_only_where_it_is_meant(signals, comes):
    assert asked(*signals) == comes


def test_before_there_is_a_flight_the_session_is_given_up_once():
    comes = asked((5.0, HUP), (5.1, HUP), (5.2, INT), flies=False)
    assert comes == [LOST, "give up", LOST, USER]


def flown(mock, folder, action, ask_landing=None):
    """A flight as the commands fly it; `action` happens in its maneuver."""
    observer = When("maneuvers", action, after=1.0)
    session = session_for(mock, folder, observer, ask_landing)
    return lockstep.run(fly_interruptibly(session))


@pytest.mark.parametrize("numbers", [(HUP, HUP), (HUP, TERM), (TERM, TERM), (INT, INT)])
def test_a_signal_that_comes_twice_still_hands_back(tmp_path, numbers):
    def lose_terminal():
        for number in numbers:
            signal.raise_signal(number)

    with mock_vehicle(tmp_path, parameters=LANDS_ALONE) as mock:
        summary = flown(mock, tmp_path / "log", lose_terminal)
        state = mock.state()
    assert summary.result.startswith("interrupted by")
    assert (state["mode"], state["armed"], state["crashed"]) == ("LOITER", True, False)


def test_signals_while_the_link_is_closed_do_not_cost_the_record(tmp_path, monkeypatch):
    closed = Link.__aexit__

    async def interrupted(link, *error):
        for number in (INT, TERM, HUP):
            judge.handle(number)
        now[0] += 2.0
        judge.handle(INT)
        await closed(link, *error)

    monkeypatch.setattr(Link, "__aexit__", interrupted)
    with mock_vehicle(tmp_path) as mock:
        observer = When("maneuvers", lambda: judge.handle(TERM), after=1.0)
        session, now = session_for(mock, tmp_path / "log", observer), [0.0]
        judge = SignalHandler(session, pytest.fail, lambda: now[0])
        summary = lockstep.run(session.fly())
    assert summary.result == "interrupted by SIGTERM"
    written = json.loads((tmp_path / "log" / "summary.json").read_text())
    assert written["result"] == summary.result
    assert len(read_flight(tmp_path / "log").rows("setpoint")) > 100


def test_leaving_keeps_the_record_and_is_done_once(tmp_path):
    with mock_vehicle(tmp_path) as mock:
        observer = When("maneuvers", lambda: (session.leave(), session.leave()), after=1.0)
        session = session_for(mock, tmp_path / "log", observer)
        summary = lockstep.run(session.fly())
    assert (summary.result, summary.phase) == ("stopped at once by the user", "maneuvers")
    assert len(read_flight(tmp_path / "log").rows("setpoint")) > 100


def test_a_terminal_that_goes_away_answers_the_question_with_no(tmp_path):
    with mock_vehicle(tmp_path) as mock:

        async def ask():
            signal.raise_signal(HUP)
            await asyncio.Event().wait()

        summary = flown(mock, tmp_path / "log", lambda: signal.raise_signal(INT), ask)
        state = mock.state()
    assert summary.result == "interrupted by the user (Ctrl-C)"
    assert (state["mode"], state["armed"]) == ("LOITER", True)


def test_a_terminal_closed_over_its_shell_leaves_the_vehicle_holding(tmp_path):
    """The kernel tells the shell and the foreground group, and the shell tells its jobs again."""
    config = tmp_path / "fly.yaml"
    with mock_vehicle(tmp_path, parameters=LANDS_ALONE) as mock:
        places = {
            "link": {"endpoint": f"udpin://127.0.0.1:{mock.port}", "lockstep": True},
            "recording": {"directory": str(tmp_path / "flights")},
            "hover": {"duration_s": 60.0},
        }
        config.write_text(yaml.safe_dump(merged(QUICK_FLIGHT, places)))
        master, slave = pty.openpty()
        shell = subprocess.Popen(
            ["setsid", "--ctty", "bash", "--norc", "-i"], stdin=slave, stdout=slave, stderr=slave
        )
        os.close(slave)
        command = f"{sys.executable} -m companion fly --config {config} >{tmp_path}/words 2>&1\n"
        os.write(master, command.encode())
        mock.until(lambda state: state["mode"] == "OFFBOARD" and state["armed"])
        os.close(master)
        shell.wait(timeout=60)
        state = mock.until(lambda _: any(text.endswith("\n") for text in kept(tmp_path)))
    assert json.loads(kept(tmp_path)[0])["result"] == f"interrupted by {LOST}"
    assert (state["mode"], state["armed"]) == ("LOITER", True)


def kept(folder):
    return [path.read_text() for path in folder.glob("flights/*/summary.json")]
