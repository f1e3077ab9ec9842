"""docs/extending.md: following its steps gives a planner, a monitor and a trajectory that fly."""

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.flight.fly import LOOP_HZ, QUICK_PARAMETERS

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs/extending.md").read_text("utf-8")
BLOCK = re.compile(r'^( *)```python(?: title="([^"]+)")?\n(.*?)^ *```$', re.MULTILINE | re.DOTALL)


def blocks() -> list[tuple[str, str]]:
    """Title and text of each Python block, without its indentation in a list."""
    return [
        (title, re.sub(f"^{indent}", "", text, flags=re.MULTILINE))
        for indent, title, text in BLOCK.findall(PAGE)
    ]


def block(title: str, containing: str = "") -> str:
    (text,) = [text for name, text in blocks() if name == title and containing in text]
    return text


@pytest.fixture(scope="module")
def tree(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the program in which a reader has followed the page."""
    tree = tmp_path_factory.mktemp("extended")
    for package in ("companion", "sitl_mock", "configs"):
        shutil.copytree(ROOT / package, tree / package)
    attitude = tree / "companion/attitude"
    (attitude / "thrust_axis.py").write_text(block("companion/attitude/thrust_axis.py"), "utf-8")
    begin, line = block("companion/attitude/planner.py").strip().splitlines()
    registry = (attitude / "planner.py").read_text("utf-8")
    assert begin in registry
    types = "from companion.attitude.types import"
    imported = "from companion.attitude.thrust_axis import thrust_axis\n"
    registry = registry.replace(begin, f"{begin}\n{line}", 1)
    registry = registry.replace(types, imported + types, 1)
    (attitude / "planner.py").write_text(registry, "utf-8")
    module = tree / "companion/safety/motion_breaches.py"
    module.write_text(
        module.read_text("utf-8") + "\n\n" + block("companion/safety/motion_breaches.py")
    )
    table = tree / "companion/safety/table.py"
    rows = '        Monitor("tilt", tilt,'
    assert rows in table.read_text("utf-8")
    row = block("companion/safety/table.py").strip().replace("sinking(3.0)", "sinking(0.2)")
    table.write_text(table.read_text("utf-8").replace(rows, f"        {row},\n{rows}", 1), "utf-8")
    return tree


QUICKLY = """
from functools import partial
from companion import testing
QUICK = {"prearm_delay_s": 0.2, "parameters": PARAMETERS, "inner_loop_hz": RATE}
QUICK["lockstep"] = {"period_ms": 1000 // RATE}
testing.MockVehicle = partial(testing.MockVehicle, **QUICK)
""".replace("PARAMETERS", repr(QUICK_PARAMETERS["px4"])).replace("RATE", str(LOOP_HZ))
"""The vehicle boots, climbs and lands quickly, with a slower loop: most of the time of a flight."""

FLIGHT = """
from companion.config.files import changed, load, shipped
from companion.testing import MockVehicle, fly
px4 = shipped("mock-px4.yaml")
changes = {"planner": {"name": "thrust-axis"}, "flight": {"maneuvers": ["hover"]}}
changes["hover"] = {"duration_s": 1.5}
changes["link"] = {"attitude_rate_hz": RATE}
summary = fly(changed(load(px4), changes, "hover"), MockVehicle(config=px4))
print(summary.result, summary.planner, [text for _, text in summary.events])
""".replace("RATE", str(LOOP_HZ))

MAY_FLY = """
from companion.attitude.thrust_axis import thrust_axis
from companion.testing import check_planner
check_planner(thrust_axis)
"""

READ = """
from pathlib import Path
from companion.config.trajectory_file import load
path = load(Path("helix.csv"))
print(path.duration, *path.at(path.duration).position)
"""

ONE_AFTER_THE_OTHER = """
import contextlib, io, json, sys, traceback
said = {}
for name, program in json.load(sys.stdin).items():
    out = io.StringIO()
    with contextlib.redirect_stdout(out):
        try:
            exec(program, {"__name__": name})
        except BaseException:
            traceback.print_exc(file=out)
    said[name] = out.getvalue()
print(json.dumps(said))
"""


@pytest.fixture(scope="module")
def said(tree: Path) -> dict[str, str]:
    """What each program prints in the extended copy, by name; one process imports for all."""
    (tree / "down.yaml").write_text("line: {to_m: [0, 0, 2], speed_m_s: 0.8}\n")
    path = {"maneuvers": ["trajectory"], "trajectory": "down.yaml", "takeoff_height_m": 5.0}
    (helix,) = [text for title, text in blocks() if not title and "helix" in text]
    programs = {
        "quickly": QUICKLY,
        "hover": FLIGHT,
        "may fly": MAY_FLY,
        "descent": FLIGHT.replace('{"maneuvers": ["hover"]}', repr(path)),
        "helix": helix + READ,
        "test": block("tests/test_mine.py") + "\n\ntest_it_holds_in_wind()\n",
    }
    done = subprocess.run(
        [sys.executable, "-c", ONE_AFTER_THE_OTHER],
        cwd=tree,
        input=json.dumps(programs),
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    said: dict[str, str] = json.loads(done.stdout)
    return said


def test_the_planner_has_its_name_and_flies(said: dict[str, str]) -> None:
    assert said["hover"].startswith("ok thrust-axis"), said["hover"]


def test_the_planner_may_fly(said: dict[str, str]) -> None:
    assert said["may fly"] == ""


def test_the_monitor_judges_in_flight(said: dict[str, str]) -> None:
    """With a limit of 0.2 m/s, a descent breaks it: the vehicle holds, then lands."""
    assert "safety: sinking: the vehicle sinks at" in said["descent"], said["descent"]
    assert "→ hold" in said["descent"]


def test_the_trajectory_is_written_and_can_be_read(said: dict[str, str]) -> None:
    assert "Traceback" not in said["helix"], said["helix"]
    duration, *end = map(float, said["helix"].split())
    assert duration > 15.0
    assert end == pytest.approx((0.0, 0.0, -2.0), abs=0.05)


def test_the_test_on_the_page_passes(said: dict[str, str]) -> None:
    assert said["test"] == ""


def test_the_members_of_a_trajectory_are_those_of_the_protocol() -> None:
    from companion.guidance.trajectory import Trajectory  # noqa: PLC0415

    section = PAGE[PAGE.index("## A trajectory of your own") : PAGE.index("## A monitor")]
    members = set(re.findall(r"^ +\| `(\w+)", section, re.MULTILINE))
    assert members == {name for name in vars(Trajectory) if not name.startswith("_")}
