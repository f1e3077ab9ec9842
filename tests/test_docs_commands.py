"""Every command on a page is run, as far as this machine can: flights up to their take-off.

Commands that fly are read, and their configuration is made and checked as before a flight: files,
keys, maneuvers, trajectories against limits and fence. `tests/cli/test_demo.py` flies `demo`.
"""

import importlib.util
import json
import re
import shlex
import tomllib
from argparse import Namespace
from collections.abc import Iterator
from itertools import pairwise
from math import cos, pi
from pathlib import Path

import pytest
import yaml

from companion.campaign.loading import load as load_campaign
from companion.cli import command_line, flying
from companion.cli.main import main
from companion.config import Config, trajectory_file
from companion.config.files import changed, load, shipped
from companion.extras import MissingExtraError
from companion.files import yaml_file
from companion.files.yaml_file import ConfigError
from companion.testing import fly
from sitl_mock.settings import load_settings
from tests.flight.fly import QuickVehicle
from tests.test_docs import BLOCK, PAGES, ROOT, command_lines, named

RECORDED = "flights/2026-11-22T10-54-16Z"
FLYING = {"demo", "fly", "identify"}
FOR_LONG = {
    "bench",
    "campaign",
    "study",
    "doctor",
    "serve",
    "tune",
}  # or a vehicle; test_docs.py reads them
SOFTWARE = ("make px4_sitl", "sim_vehicle.py")  # of the autopilots, not in this repository


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder in which a reader has done what comes before: files written, one flight recorded."""
    folder = tmp_path_factory.mktemp("reader")
    (folder / "configs").symlink_to(ROOT / "configs")
    (folder / "docs").mkdir()
    for name, kind in (("my", "px4"), ("my-px4", "px4"), ("my-ardupilot", "ardupilot")):
        assert main(["init", kind, "--out", str(folder / f"{name}.yaml")]) == 0
    rows = [f"{0.1 * k},{1.0 - cos(0.1 * pi * 0.1 * k)},0,0" for k in range(101)]  # 2 m in 10 s
    (folder / "my-path.csv").write_text("\n".join(["t,x,y,z", *rows]) + "\n")
    px4 = shipped("mock-px4.yaml")
    short = {"flight": {"maneuvers": ["hover"]}, "hover": {"duration_s": 1.0}}
    vehicle = QuickVehicle(config=px4)
    fly(changed(load(px4), short, "short"), vehicle, folder / RECORDED)
    return folder


def all_command_lines() -> list[tuple[str, list[str]]]:
    """Page and arguments of each different `companion …` with more than the name of a command."""
    found: dict[tuple[str, ...], str] = {}
    for page in PAGES:
        for arguments in command_lines(page.read_text("utf-8")):
            if len(arguments) > 1 or arguments in (["config"], ["demo"]):
                found.setdefault(tuple(arguments), named(page))
    return [(page, list(arguments)) for arguments, page in found.items()]


def placed(arguments: list[str]) -> list[str]:
    """The arguments with the names of files that stand for the reader's own."""
    names = {"FILE": "my.yaml", "FOLDER": RECORDED, "FOLDER/config.yaml": f"{RECORDED}/config.yaml"}
    flight = re.compile(r"flights/[\dTZ-]+")  # whichever one the page shows
    return [flight.sub(RECORDED, names.get(word, word)) for word in arguments]


@pytest.fixture(scope="module")
def ran_before() -> set[tuple[str, ...]]:
    """What ran already, as placed: pages name the same flight by its time or as FOLDER."""
    return set()


@pytest.mark.parametrize(
    ("page", "arguments"), all_command_lines(), ids=lambda value: str(value).replace("/", "_")
)
def test_the_command_runs(
    page: str,
    arguments: list[str],
    folder: Path,
    ran_before: set[tuple[str, ...]],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(folder)
    command, *rest = placed(arguments)
    if command.startswith("-") or command in FOR_LONG or "--log" in rest:
        return
    if command == "fly" and "--config" not in rest:  # the text names an option
        rest += ["--config", "my.yaml"]
    if command in FLYING:
        text = (ROOT / page).read_text("utf-8")
        if re.search(re.escape(shlex.join(arguments)) + r" +# refused", text):
            with pytest.raises(ConfigError):
                ready_to_fly(command_line.parse([command, *rest]))
        else:
            ready_to_fly(command_line.parse([command, *rest]))
        return
    if (command, *rest) in ran_before:
        return
    for out in (Path(b) for a, b in pairwise(rest) if a == "--out"):
        out.unlink(missing_ok=True)
    assert main([command, *rest]) == 0, f"{page}: companion {shlex.join(arguments)}"
    ran_before.add((command, *rest))


def ready_to_fly(options: Namespace) -> None:
    """Make the configuration of a flight as the command does, with all its checks."""
    bundled = options.run == "cli.flights.demo" or getattr(options, "bundled", None) is not None
    path = getattr(options, "bundled", None) or options.config
    if path in (None, Path()):
        path = shipped("mock-px4.yaml")
    if bundled:
        options.endpoint, options.arm, options.take_over = "udpin://127.0.0.1:14540", True, False
    planner = None
    if options.run.startswith("cli.identify"):
        options.maneuvers, planner = ("identify",), "first-order"
    try:
        flying.with_options(load(path), options, planner)
    except MissingExtraError as error:
        pytest.skip(str(error))


def shell_lines() -> Iterator[tuple[Path, str]]:
    """Each line of a shell block that is no `companion …`."""
    for page in PAGES:
        for language, block in BLOCK.findall(page.read_text("utf-8")):
            if language == "sh":
                for line in block.replace("\\\n", " ").splitlines():
                    text = line.strip()
                    if text and not re.match(r"(\.venv/bin/)?companion |#", text):
                        yield page, text


@pytest.mark.parametrize(
    ("page", "line"), list(shell_lines()), ids=lambda value: str(value).replace("/", "_")[:60]
)
def test_other_commands_name_what_exists(page: Path, line: str) -> None:
    if line.startswith(SOFTWARE):
        return
    if " | nc " in line:
        (fault,) = json.loads(shlex.split(line)[1]).values()
        assert load_settings(None, {"faults": [fault]}).faults
        return
    program, *words = shlex.split(line, comments=True)
    if program == "make":
        targets = re.findall(r"^([\w-]+):", (ROOT / "Makefile").read_text("utf-8"), re.MULTILINE)
        assert words[0] in targets
    elif program == "dask":
        assert importlib.util.find_spec(f"distributed.cli.dask_{words[0]}") is not None
    elif program == ".venv/bin/pip":
        project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
        (extras,) = re.findall(r"\.\[([\w,]+)\]", words[-1])
        assert set(extras.split(",")) <= set(project["optional-dependencies"])
    elif program.endswith("python") and words[0] == "-m":
        assert importlib.util.find_spec(words[1]) is not None
        if words[1] == "sitl_mock":
            assert load_settings(ROOT / words[words.index("--config") + 1], {}).autopilot
    elif program.endswith("python"):
        shown = f'```python title="{words[0]}"' in page.read_text("utf-8")
        assert shown or (ROOT / words[0]).is_file()
    else:
        pytest.fail(f"{named(page)}: no test knows `{line}`")


def yaml_blocks() -> list[tuple[Path, str]]:
    return [
        (page, block)
        for page in PAGES
        for language, block in BLOCK.findall(page.read_text("utf-8"))
        if language == "yaml"
    ]


@pytest.mark.parametrize(("page", "block"), yaml_blocks(), ids=lambda value: str(value)[-30:])
def test_configurations_on_pages_are_valid(page: Path, block: str, tmp_path: Path) -> None:
    data = yaml.safe_load(block)
    if data.keys() & {"apiVersion", "jobqueue"}:  # of Kubernetes and dask-jobqueue
        return
    if "sweep" in data:
        path = tmp_path / "campaign.yaml"
        (tmp_path / "configs").symlink_to(ROOT / "configs")
        path.write_text(block, "utf-8")
        assert len(list(load_campaign(path).cases())) > 1
    elif "make real REAL=" in block:  # describes a build of an autopilot
        assert {"autopilot", "start", "folder"} <= set(data)
    elif "--trajectory" in block:
        path = tmp_path / "my-path.yaml"
        path.write_text(block, "utf-8")
        assert trajectory_file.load(path)
    elif "mock" in data:
        assert load_settings(None, {**data["mock"]}).autopilot == data["mock"]["autopilot"]
    else:
        data.pop("include", None)
        if (
            "my-guidance" in block or "sinking" in block
        ):  # a name that an installed package of the reader's brings
            return
        yaml_file.parse(yaml.safe_dump(data), named(page), Config)
