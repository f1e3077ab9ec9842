"""The solver's process: asked, answering, late, killed; every fault is injected."""

import importlib.util
import os
import signal
import subprocess
import sys
from dataclasses import replace
from math import nan
from time import monotonic, sleep

import psutil
import pytest

from companion.attitude import BodyRates, Coefficients, attitude
from companion.drag import Drag
from companion.extras import MissingExtraError
from companion.guidance.trajectory.figures import Hover, Laps, circle
from companion.nmpc import (
    ControlInput,
    Request,
    Settings,
    Solver,
    Start,
    Trouble,
    VehicleSnapshot,
)
from companion.nmpc.worker import Worker

SETTINGS = Settings(dead_time=0.045, deadline=2.0)
DRAG = Drag(0.6, 0.08)
CIRCLE = circle(5.0, Laps(5.0, laps=4.0))
LONG = 20.0
"""More than anything here takes, s."""


class Flight:
    """A solver, what it reported, and requests for it."""

    def __init__(self, settings=SETTINGS, trajectory=CIRCLE):
        self.troubles = []
        self.solver = Solver(settings, trajectory, lambda *trouble: self.troubles.append(trouble))

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.solver.close()

    def warm(self):
        until = monotonic() + LONG
        while self.solver.alive and not self.solver.ready and monotonic() < until:
            sleep(0.01)
        assert self.solver.ready
        return self

    @property
    def kinds(self):
        return [kind for kind, _ in self.troubles]

    def child(self):
        return psutil.Process(self.solver.pid)


def request(number, **changes):
    time = 6.0 + 0.02 * number
    sample = CIRCLE.at(time)
    rest = BodyRates(0.0, 0.0, 0.0)
    vehicle = VehicleSnapshot(
        time, sample.position, sample.velocity, (1.0, 0.0, 0.0, 0.0), rest, drag=DRAG
    )
    inputs = tuple(ControlInput(time - 0.02 * k, 0.01 * k, 0.0, 0.1, 9.8) for k in range(5, 0, -1))
    vehicle = vehicle._replace(**changes)
    return Request(number, vehicle, time, Start((0.0, 0.0, 0.0)), inputs)


@pytest.fixture(scope="module")
def shared():
    """For the tests that leave it as it was."""
    with Flight() as flight:
        yield flight.warm()


@pytest.fixture
def flight(shared):
    shared.troubles.clear()
    return shared


def test_an_answer_is_that_of_the_same_worker_here(flight):
    flight.solver.request(request(1))
    found = flight.solver.take_answer(LONG)
    worker = Worker(SETTINGS, CIRCLE)
    worker.warm_up()
    wanted = worker.answer(request(1))
    assert found.number == 1
    assert found.time == 6.02 + SETTINGS.lead
    assert found[4:8] == pytest.approx(wanted[4:8], abs=1e-9)
    assert 0.0 < found.solver_seconds < found.computing_seconds < LONG
    assert not flight.troubles


def test_an_answer_is_handed_out_once_and_nothing_blocks(flight):
    child = flight.child()
    child.suspend()
    flight.solver.request(request(2))
    assert flight.solver.take_answer() is None
    child.resume()
    assert flight.solver.take_answer(LONG).number == 2
    assert flight.solver.take_answer() is None
    assert not flight.troubles


def test_what_was_asked_before_is_late_and_its_answer_is_not_taken_for_the_next(flight):
    child = flight.child()
    child.suspend()
    flight.solver.request(request(4))
    flight.solver.request(request(5))
    child.resume()
    assert flight.solver.take_answer(LONG).number == 5
    assert flight.kinds == [Trouble.LATE]
    assert "request 4 was not answered before the next one" in flight.troubles[0][1]


def test_a_vehicle_upside_down_is_a_failure_and_the_next_is_not(flight):
    flight.solver.request(request(6, q=(0.0, 1.0, 0.0, 0.0)))
    assert flight.solver.take_answer(LONG) is None
    flight.solver.request(request(7, position=(nan, 0.0, 0.0)))
    assert flight.solver.take_answer(LONG) is None
    assert flight.kinds == [Trouble.FAILED, Trouble.FAILED]
    assert "tilted too far" in flight.troubles[0][1]
    flight.solver.request(request(8))
    assert flight.solver.take_answer(LONG).number == 8


def change_answers(monkeypatch, **changes):
    """Let the flight receive answers with other values."""
    judged = Solver._usable_answer
    monkeypatch.setattr(
        Solver,
        "_usable_answer",
        lambda solver, asked, answer: judged(solver, asked, answer._replace(**changes)),
    )


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"north": nan}, "not finite"),
        ({"thrust": 30.0}, "thrust of 30.00"),
        ({"thrust": 1.0}, "thrust of 1.00"),
        ({"north": 0.6, "east": -0.6}, "length 0.849"),
    ],
)
def test_an_absurd_answer_is_not_handed_out(flight, monkeypatch, changes, words):
    change_answers(monkeypatch, **changes)
    flight.solver.request(request(9))
    assert flight.solver.take_answer(LONG) is None
    assert flight.kinds == [Trouble.IMPLAUSIBLE]
    assert words in flight.troubles[0][1]


def test_a_tilt_beyond_the_limit_is_not_absurd_while_the_vehicle_has_it(flight, monkeypatch):
    change_answers(monkeypatch, north=0.8, east=0.0)
    flight.solver.request(request(10, q=attitude(Coefficients(0.8, 0.0), 0.0)))
    assert flight.solver.take_answer(LONG).number == 10


def test_no_answer_within_the_deadline_is_late_once():
    with Flight(replace(SETTINGS, deadline=0.5)) as flight:
        flight.warm()
        child = flight.child()
        child.suspend()
        flight.solver.request(request(1))
        assert flight.solver.take_answer() is None
        assert not flight.troubles
        assert flight.solver.take_answer(0.6) is None
        assert flight.solver.take_answer() is None
        assert flight.kinds == [Trouble.LATE]
        child.resume()
        flight.solver.request(request(2))  # the late answer to the first comes before its answer
        assert flight.solver.take_answer(LONG).number == 2


def test_an_answer_after_the_deadline_is_late_however_soon_it_is_taken():
    with Flight(replace(SETTINGS, deadline=1e-6)) as flight:
        flight.warm().solver.request(request(1))
        assert flight.solver.take_answer(LONG) is None
        assert flight.kinds == [Trouble.LATE]
        assert "took" in flight.troubles[0][1]


def test_a_killed_process_is_noticed_at_once_and_nothing_is_asked_of_it():
    with Flight() as flight:
        flight.warm().solver.request(request(1))
        os.kill(flight.solver.pid, signal.SIGKILL)
        while flight.solver.alive:
            assert flight.solver.take_answer(LONG) is None
        assert flight.kinds == [Trouble.DIED]
        assert "ended by signal 9" in flight.troubles[0][1]
        flight.solver.request(request(2))
        assert flight.solver.take_answer() is None
        assert not flight.solver.ready
        assert flight.kinds == [Trouble.DIED]


def test_a_process_that_cannot_begin_says_why():
    with Flight(trajectory=None) as flight:
        while flight.solver.alive:
            assert not flight.solver.ready
            sleep(0.01)
        assert flight.kinds == [Trouble.DIED]
        assert "'NoneType' object has no attribute 'at'" in flight.troubles[0][1]


def test_it_is_less_urgent_than_the_flight_and_goes_with_it():
    with Flight(replace(SETTINGS, niceness=7), Hover(10.0)) as flight:
        child = flight.warm().child()
        assert child.nice() == min(19, psutil.Process().nice() + 7)
        child.send_signal(signal.SIGINT)  # the terminal sends it to both
        flight.solver.request(request(1))
        assert flight.solver.take_answer(LONG) is not None
        flight.solver.close()
        assert not child.is_running()
        flight.solver.close()
    assert not flight.troubles


def test_a_solver_whose_flight_vanished_ends():
    program = (
        "import os, time; from companion.nmpc import Settings, Solver;"
        "from companion.guidance.trajectory.figures import Hover;"
        "s = Solver(Settings(), Hover(1.0), print);\n"
        "while not s.ready: time.sleep(0.01)\n"
        "print(s.pid, flush=True); os._exit(0)"
    )
    asked = [sys.executable, "-c", program]
    done = subprocess.run(asked, capture_output=True, text=True, check=True)
    until = monotonic() + LONG
    while runs(int(done.stdout)):
        assert monotonic() < until
        sleep(0.01)


def runs(pid):
    """Whether it does; an orphan may stay a zombie, if nobody waits for it."""
    try:
        return psutil.Process(pid).status() != psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return False


def test_a_flight_imports_no_casadi():
    program = "import sys, companion.nmpc; sys.exit('casadi' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", program], check=False).returncode == 0


def test_without_the_extra_one_sentence_says_what_to_install(monkeypatch):
    found = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name: None if name == "casadi" else found(name)
    )
    with pytest.raises(MissingExtraError, match=r"-m pip install .*\[nmpc\]'"):
        Flight()
