"""What users test their own programs with works from an installed wheel, in an empty folder."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "examples/planner_package"
SOURCES = ("companion", "sitl_mock", "configs", "pyproject.toml", "README.md", "LICENSE")


def run(folder, *command, **environment):
    """Run a command in a folder, with what is installed in `folder/site` before all else."""
    done = subprocess.run(
        [sys.executable, "-m", *map(str, command)],
        cwd=folder,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.mark.slow
@pytest.mark.timeout(300)
def test_a_planner_package_is_tested_by_fixture_and_conformance_test(tmp_path):
    """The wheel is built from a copy, so that nothing is left beside the sources."""
    copy, site, empty = (tmp_path / name for name in ("source", "site", "empty"))
    copy.mkdir()
    empty.mkdir()
    for name in SOURCES:
        put = shutil.copytree if (ROOT / name).is_dir() else shutil.copy
        put(ROOT / name, copy / name)
    planner = shutil.copytree(PACKAGE, tmp_path / "planner")
    run(tmp_path, "pip", "install", "--quiet", "--no-deps", "--target", site, copy, planner)
    shutil.copy(PACKAGE / "test_thrust_axis_planner.py", empty)
    (empty / "conftest.py").write_text(
        "import companion, pathlib\n"
        f"assert pathlib.Path(companion.__file__).is_relative_to({str(site)!r})\n"
    )
    said = run(empty, "pytest", "-q", "-p", "no:cacheprovider", PYTHONPATH=str(site))
    assert "2 passed" in said
    assert (site / "companion/py.typed").exists()
