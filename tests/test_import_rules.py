"""The import rules of pyproject.toml hold, and they do bite."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
LINT = "from importlinter.cli import lint_imports; raise SystemExit(lint_imports(no_cache=True))"


def lint(folder):
    """Lint the packages that lie in `folder`, whatever is installed."""
    return subprocess.run(
        [sys.executable, "-c", LINT],
        cwd=folder,
        env={"PYTHONPATH": str(folder)},
        capture_output=True,
        text=True,
        check=False,
    )


def test_imports_point_one_way():
    done = lint(ROOT)
    assert done.returncode == 0, done.stdout


FORBIDDEN = [
    ("sitl_mock/physics/vehicle.py", "companion.attitude"),
    ("sitl_mock/physics/sensors.py", "sitl_mock.autopilot.state"),
    ("sitl_mock/physics/rotors.py", "sitl_mock.link.framing"),
    ("sitl_mock/settings.py", "sitl_mock.px4.parameters"),
    ("sitl_mock/autopilot/state.py", "sitl_mock.autopilot.interface"),
    ("companion/flight/watch.py", "sitl_mock.physics.rigid_body"),
    ("companion/attitude/limits.py", "companion.guidance"),
    ("companion/guidance/feedback.py", "asyncio"),
    ("companion/attitude/history.py", "numpy"),
    ("companion/mavlink/codec.py", "companion.vehicle.link"),
    ("companion/vehicle/link.py", "companion.config"),
    ("companion/preflight/report.py", "companion.vehicle.px4.events"),
    ("companion/control/guidance_command.py", "companion.safety.ladder"),
    ("companion/recording/tlog.py", "companion.config"),
    ("companion/nmpc/messages.py", "casadi"),
    ("companion/flight/watch.py", "companion.study.step"),
    ("companion/batch/__init__.py", "companion.study.step"),
    ("companion/study/inner_loop.py", "sitl_mock.physics.vehicle"),
    ("companion/study/step.py", "sitl_mock.physics.multirotor"),
]
"""File, and what it may not import."""

CIRCLES = {"sitl_mock/autopilot/state.py": ".state -> .interface"}
"""How the report names the import that closes a circle."""


@pytest.fixture(scope="module")
def report(tmp_path_factory):
    """What is said of a copy of the packages with all the forbidden imports in it."""
    folder = tmp_path_factory.mktemp("forbidden")
    for package in ("companion", "sitl_mock"):
        shutil.copytree(ROOT / package, folder / package)
    shutil.copy(ROOT / "pyproject.toml", folder)
    for path, imported in FORBIDDEN:
        with (folder / path).open("a") as source:
            source.write(f"import {imported}\n")
    done = lint(folder)
    assert done.returncode == 1, done.stdout
    return done.stdout.partition("Broken contracts")[2]


@pytest.mark.parametrize(("path", "imported"), FORBIDDEN)
def test_a_forbidden_import_is_found(report, path, imported):
    module = path.removesuffix(".py").removesuffix("/__init__").replace("/", ".")
    assert CIRCLES.get(path, f"{module} -> {imported} (l.") in report
