"""The public packages: what design and documentation promise, and that help() is one page."""

import doctest
import importlib
import inspect
import pydoc
import re
import subprocess
import sys
from types import ModuleType

import numpy as np
import pytest

import companion
import companion.api
from companion import attitude, batch
from companion.attitude import (
    BodyRates,
    Coefficients,
    Constants,
    InvalidQuaternionError,
    Limits,
    Quaternion,
    Target,
    TiltYaw,
    coefficients,
    decompose,
    heading,
    make_planner,
)

PACKAGES = (
    "companion.attitude",
    "companion.batch",
    "companion.guidance.trajectory",
    "companion.identification",
    "companion.testing",
)
MOST_LINES = 100  # of help(): one page, and no methods of tuples
LEVEL: Quaternion = (1.0, 0.0, 0.0, 0.0)
SIX = ("first-order", "exact", "model-following", "quaternion", "so3", "euler")


@pytest.fixture(params=PACKAGES)
def package(request: pytest.FixtureRequest) -> ModuleType:
    return importlib.import_module(request.param)


def public_names(package: ModuleType) -> set[str]:
    """Everything that the package offers, without its own modules."""
    return {
        name
        for name, value in inspect.getmembers(package)
        if not name.startswith("_")
        and not inspect.ismodule(value)
        and name not in ("TYPE_CHECKING", "import_module")  # of a package that loads lazily
    }


def test_help_is_one_page(package: ModuleType) -> None:
    page = pydoc.plain(pydoc.render_doc(package))
    assert len(page.splitlines()) <= MOST_LINES
    assert "Method resolution order" not in page


def test_help_names_everything_that_is_public(package: ModuleType) -> None:
    words = set(re.findall(r"\w+", package.__doc__ or ""))
    assert public_names(package) <= words


def test_what_help_names_exists(package: ModuleType) -> None:
    """The first words of the indented lines of its lists are names of the package."""
    lines = re.findall(r"^    (\w+(?:, \w+)*)(?:  |$)", package.__doc__ or "", re.MULTILINE)
    named = {name for line in lines for name in line.split(", ")}
    assert len(named) >= 5
    assert named <= public_names(package)


def test_the_example_of_help_is_true(package: ModuleType) -> None:
    if package.__name__ == "companion.testing":
        return  # a whole flight: tests/testing flies it
    finder = doctest.DocTestFinder(recurse=False)
    tests = [test for test in finder.find(package) if test.examples]
    assert tests, "its docstring shows no example"
    for test in tests:
        assert doctest.DocTestRunner().run(test).failed == 0


def test_every_function_and_class_explains_itself(package: ModuleType) -> None:
    for name in public_names(package):
        value = getattr(package, name)
        if inspect.isfunction(value) or inspect.isclass(value):
            assert inspect.getdoc(value), f"{package.__name__}.{name}"


def test_the_six_planners_answer_alike() -> None:
    """Level and asked to the north, each pitches the nose down."""
    assert set(attitude.PLANNER_NAMES) == set(SIX)
    for name in SIX:
        times = {"lag": 0.0, "dead_time": 0.0} if name == "model-following" else {}
        planner = make_planner(name, gain=5.0, yaw_gain=2.0, limits=Limits(max_tilt=0.6), **times)
        planner.reset(LEVEL, body_rates=None)
        rates = planner.rates(LEVEL, Target(0.2, 0.0, 0.0), 0.004, BodyRates(0.0, 0.0, 0.0))
        assert isinstance(rates, BodyRates)
        assert rates.pitch < 0.0
        assert rates.roll == pytest.approx(0.0, abs=1e-12)
        assert planner.rates((1, 0, 0, 0), (0.2, 0.0, 0.0), dt=0.004).pitch < 0.0  # plain tuples


def test_the_functions_of_an_attitude() -> None:
    q = attitude.attitude(Coefficients(0.3, -0.1), 1.0)
    assert coefficients(q) == pytest.approx((0.3, -0.1))
    assert heading(q) == pytest.approx(1.0)
    split = decompose(q)
    assert isinstance(split, TiltYaw)
    assert split._fields == ("a", "b", "x", "y", "z")
    assert coefficients((-q[0], -q[1], -q[2], -q[3])) == pytest.approx((0.3, -0.1))
    with pytest.raises(InvalidQuaternionError):
        heading((2.0, 0.0, 0.0, 0.0))


def test_limits_and_target_have_their_defaults() -> None:
    limits = Limits()
    assert (limits.max_tilt, limits.max_tilt_rate, limits.max_yaw_rate) == (None, None, None)
    assert limits.shape == "tight"
    assert Target(0.1, 0.2, 0.3).heading_rate == 0.0


def test_model_following_takes_the_response_of_the_rate_loop() -> None:
    times = {"lag": 0.05, "dead_time": 0.04, "yaw_lag": 0.3, "yaw_dead_time": 0.1}
    planner = make_planner("model-following", gain=5.0, **times)
    assert planner.rates(LEVEL, Target(0.2, 0.0, 0.0), 0.004).pitch < 0.0


def proportional(
    q: Quaternion, target: Target, dt: float, constants: Constants
) -> tuple[float, float, float]:
    (north, east), (to_north, to_east, _, _) = coefficients(q), target
    return constants.gain * (to_east - east), constants.gain * (north - to_north), 0.0


def test_a_law_of_ones_own_makes_a_planner_and_a_batch() -> None:
    planner = make_planner(proportional, gain=3.0, limits=Limits(max_tilt=0.1))
    assert planner.rates(LEVEL, Target(0.05, 0.0, 0.0), 0.004) == pytest.approx((0.0, -0.15, 0.0))
    # A target beyond the tilt limit is shortened before the law sees it.
    assert planner.rates(LEVEL, Target(0.5, 0.0, 0.0), 0.004).pitch == pytest.approx(-0.3, rel=0.01)
    targets = np.reshape((0.05, 0.0, 0.0, 0.0), (4, 1))
    rates = batch.rates(planner, np.reshape(LEVEL, (4, 1)), targets, 0.004)
    assert rates[:, 0] == pytest.approx((0.0, -0.15, 0.0))


def test_the_coefficients_of_a_batch_are_those_of_each_attitude() -> None:
    rng = np.random.default_rng(1)
    q = rng.normal(size=(3, 4, 5))
    q /= np.linalg.norm(q, axis=1, keepdims=True)
    together = batch.coefficients(q)
    assert together.shape == (3, 2, 5)
    for moment in range(3):
        for vehicle in range(5):
            alone = coefficients(tuple(q[moment, :, vehicle]))
            assert together[moment, :, vehicle] == pytest.approx(alone, abs=1e-15)


def test_help_of_the_program_is_one_page_with_its_names() -> None:
    page = pydoc.plain(pydoc.render_doc(companion))
    assert len(page.splitlines()) <= MOST_LINES
    listed = re.findall(r"^    (\w+)  ", companion.__doc__ or "", re.MULTILINE)
    assert set(listed) == set(companion._PUBLIC_NAMES) == public_names(companion.api)
    assert all(getattr(companion, name).__doc__ for name in companion._PUBLIC_NAMES)


def test_an_interactive_python_completes_the_names_before_their_import() -> None:
    script = "import companion; print('connect' in dir(companion))"
    found = subprocess.run([sys.executable, "-c", script], capture_output=True, check=True)
    assert found.stdout.strip() == b"True"
