"""acados' solver gives the answers of CasADi's, where an interpreter that has it is named.

COMPANION_ACADOS_PYTHON names it, since acados cannot live in the environment of these tests.
"""

import os
import subprocess
from dataclasses import replace
from pathlib import Path

import pytest

from companion.attitude import BodyRates
from companion.drag import Drag
from companion.extras import MissingExtraError
from companion.guidance.trajectory.figures import Laps, circle
from companion.nmpc import Input, Request, Settings, Solver, Start, Status, Vehicle
from companion.nmpc.planning import Planning
from companion.nmpc.solvers import compile_ahead

PYTHON = os.environ.get("COMPANION_ACADOS_PYTHON")
pytestmark = pytest.mark.skipif(PYTHON is None, reason="COMPANION_ACADOS_PYTHON names none")

CIRCLE = circle(5.0, Laps(5.0, laps=4.0))
SETTINGS = Settings(dead_time=0.045, deadline=20.0, solver="acados")
KEYS = """
from dataclasses import replace
from companion.nmpc import Settings
from companion.nmpc.acados_backend import _described
from companion.nmpc.acados_build import _key
from companion.nmpc.models import make_model
told = Settings()
for changes in ({}, {"niceness": 1}, {"gain": 5.0000001}, {"max_thrust": 17.9}, {"steps": 21}):
    settings = replace(told, **changes)
    print(_key(_described(make_model(settings), settings)))
"""


@pytest.fixture(scope="module")
def cache(tmp_path_factory):
    """A cache of the tests' own, in which our model is compiled, at the second try."""
    folder = tmp_path_factory.mktemp("cache")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(folder))
        patch.setenv("CC", "false")
        with pytest.raises(MissingExtraError, match="cannot be compiled in"):
            compile_ahead(SETTINGS, Path(PYTHON))
        patch.delenv("CC")
        compile_ahead(SETTINGS, Path(PYTHON))
        yield folder


def libraries(folder):
    return {path: path.stat().st_mtime_ns for path in folder.rglob("*.so")}


def asked(number):
    """At rest, where the circle is flown at 5 m/s, and a little further each time."""
    time = 6.0 + 0.02 * number
    north, east, down = CIRCLE.at(6.0).position
    position = north + 0.01 * number, east, down
    rest = BodyRates(0.0, 0.0, 0.0)
    vehicle = Vehicle(
        time, position, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0), rest, drag=Drag(0.6, 0.08)
    )
    inputs = tuple(Input(time - 0.02 * k, 0.01 * k, 0.0, 0.1, 9.8) for k in range(5, 0, -1))
    return Request(number, vehicle, time, Start((0.0, 0.0, 0.0)), inputs)


def test_both_solvers_give_the_same_answers_and_nothing_is_compiled_again(cache):
    compiled, troubles = libraries(cache), []
    solver = Solver(SETTINGS, CIRCLE, lambda *trouble: troubles.append(trouble), Path(PYTHON))
    ours = Planning(replace(SETTINGS, solver="hpipm"), CIRCLE)
    ours.warm_up()
    try:
        while not solver.ready:
            assert solver.alive, troubles
        for number in range(20):
            solver.request(asked(number))
            theirs, wanted = solver.take(20.0), ours.answer(asked(number))
            assert wanted.status is Status.SOLVED
            assert theirs[4:8] == pytest.approx(wanted[4:8], abs=1e-3)
            assert theirs.iterations == 1
    finally:
        solver.close()
    assert not troubles
    assert len(compiled) == 1
    assert libraries(cache) == compiled


def test_what_is_compiled_is_told_apart_by_all_that_goes_into_it():
    done = subprocess.run([PYTHON, "-c", KEYS], capture_output=True, text=True, check=True)
    same, also, *others = done.stdout.split()
    assert same == also
    assert len({same, *others}) == 4
