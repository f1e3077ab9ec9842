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


@pytest.mark.parametrize(
    ("module", "line"),
    [
        ("sitl_mock/physics/vehicle.py", "import companion.attitude"),
        ("sitl_mock/physics/sensors.py", "import sitl_mock.autopilot.state"),
        ("sitl_mock/physics/rotors.py", "import sitl_mock.link.framing"),
        ("sitl_mock/settings.py", "import sitl_mock.px4.parameters"),
        ("sitl_mock/autopilot/events.py", "import sitl_mock.autopilot.personality"),
        ("companion/flight/watch.py", "import sitl_mock.physics.rigid_body"),
        ("companion/attitude/limits.py", "import companion.guidance"),
        ("companion/guidance/feedback.py", "import asyncio"),
        ("companion/attitude/history.py", "import numpy"),
        ("companion/mavlink/codec.py", "import companion.vehicle.link"),
        ("companion/vehicle/link.py", "import companion.config"),
        ("companion/preflight/report.py", "import companion.vehicle.px4.events"),
        ("companion/control/guidance_command.py", "import companion.safety.ladder"),
        ("companion/recording/tlog.py", "import companion.config"),
        ("companion/nmpc/messages.py", "import casadi"),
        ("companion/flight/watch.py", "import companion.study.step"),
        ("companion/batch/__init__.py", "import companion.study.step"),
        ("companion/study/inner_loop.py", "import sitl_mock.physics.vehicle"),
        ("companion/study/step.py", "import sitl_mock.physics.multirotor"),
    ],
)
def test_a_forbidden_import_is_found(tmp_path, module, line):
    for package in ("companion", "sitl_mock"):
        shutil.copytree(ROOT / package, tmp_path / package)
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    with (tmp_path / module).open("a") as source:
        source.write(f"{line}\n")
    done = lint(tmp_path)
    assert done.returncode == 1, done.stdout
    assert "BROKEN" in done.stdout
