"""Mutation testing with mutmut: `nice -n 19 python -m tests.mutants attitude safety`.

Each room of `companion` is judged by the quick tests of its own folder. A survivor is a change of
the code that none of them notices: it needs a test, or a line with the reason in `accepted.toml`.
Exit code 1 if a room has fewer than 85 % of its mutants killed.
"""

import argparse
import contextlib
import os
import random
import shutil
import subprocess
import sys
import tomllib
from fnmatch import fnmatch
from pathlib import Path

from companion.extras import MissingExtraError, require
from tests.mutants.report import WANTED, Mutant, print_room
from tests.mutants.seconds import measured_seconds

ROOMS = {
    "attitude": ["tests/attitude"],
    "guidance": ["tests/guidance", "tests/trajectory"],
    "control": [
        "tests/control",
        "tests/flight/test_changes.py",
        "tests/flight/test_predictive.py",
        "tests/flight/test_thrust.py",
    ],
    "safety": ["tests/safety"],
    "vehicle": ["tests/vehicle", "tests/mavlink"],
}
"""Room of `companion` -> the folders and files of tests that judge it, of those that exist."""

_ROOT = Path(__file__).parents[2]
_COPIED = ["sitl_mock", "configs", "docs", "README.md"]
"""What the tests read besides `companion` and `tests`."""

_NOT_MUTATED = [r"^\s*raise \w+\("]
"""The wording of errors. That they are raised, and when, is the condition above them."""


_NOT_RUN = ["--ignore-glob=*/test_add_a_*.py"]
"""Tests that read the code itself: mutants stand in it beside the functions."""

_PRELOADED = ["casadi", "hypothesis", "numpy", "pydantic", "pymavlink", "pytest", "scipy"]
"""What each process of a mutant inherits; the program itself it imports anew, as code that runs at
import is mutated, too."""

_NONE = "companion.none"
"""A pattern that fits no mutant: mutmut makes the mutants and the tests' times, and then fails."""

_TEST_TIMEOUT_S = 60
"""After this time a test of a mutant waits for what never comes, also on a busy computer."""

_PATIENCE_S = 3.0
"""Added to a test's own time; fifteen times the sum is an endless loop, also on a busy computer."""


def main() -> int:
    """Mutate, test and report each room."""
    parser = argparse.ArgumentParser(prog="python -m tests.mutants", description=__doc__)
    parser.add_argument("rooms", nargs="*", metavar="ROOM", help=f"of {', '.join(ROOMS)}; all")
    parser.add_argument("--only", default="*", help="module and function: 'rotation.*'")
    parser.add_argument("--again", action="store_true", help="what the last run has not killed")
    parser.add_argument("--sample", type=int, help="try only so many mutants, drawn at random")
    parser.add_argument("--seed", type=int, default=0, help="of the draw")
    parser.add_argument("--limit", type=float, default=1.0, help="CPU s of a quick test")
    parser.add_argument("--children", type=int, default=os.cpu_count(), help="processes")
    options = parser.parse_args()
    try:
        require("mutmut", "mutants", "`tests.mutants`")
    except MissingExtraError as error:
        parser.error(str(error))
    unknown = set(options.rooms) - set(ROOMS)
    if unknown:
        parser.error(f"no such room: {', '.join(sorted(unknown))}")
    accepted = tomllib.loads((Path(__file__).parent / "accepted.toml").read_text()).get(
        "accepted", []
    )
    good = True
    for room in options.rooms or ROOMS:
        folder = _ROOT / "build" / "mutants" / room
        chosen = [f"companion.{room}.{options.only}"]
        if options.again:
            chosen = [mutant.name for mutant in _mutants(folder) if not mutant.killed]
        else:
            _prepare(folder, room, options.limit)
            if options.sample:
                _mutmut(folder, "run", "--max-children", "1", _NONE, may_fail=True)  # makes them
                names = sorted(m.name for m in _mutants(folder) if fnmatch(m.name, chosen[0]))
                chosen = random.Random(options.seed).sample(names, min(options.sample, len(names)))
        _mutmut(folder, "run", "--max-children", str(options.children), *chosen)
        mutants = [mutant for mutant in _mutants(folder) if mutant.status != "not checked"]
        _find_changes(folder, mutants)
        score = print_room(room, mutants, accepted)
        good &= score >= WANTED
    return 0 if good else 1


def _prepare(folder: Path, room: str, limit_s: float) -> None:
    """Make a project of its own for mutmut, so that rooms have their own settings and results."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for name in ["companion", "tests", *_COPIED]:
        (folder / name).symlink_to(_ROOT / name)
    tests = [tests for tests in ROOMS[room] if (_ROOT / tests).exists()]
    seconds = measured_seconds(_ROOT, tests, folder / "seconds.json")
    slow = sorted(test for test, cpu_s in seconds.items() if cpu_s > limit_s)
    print(f"{room}: {len(seconds) - len(slow)} tests; {len(slow)} take over {limit_s:g} s of CPU")
    # Names with ° are escaped anew by each run in one process, and then not found.
    unescaped = "disable_test_id_escaping_and_forfeit_all_rights_to_community_support=true"
    arguments = ["-m", "not slow", "-p", "no:cacheprovider", "-o", unescaped]
    arguments += ["-o", f"timeout={_TEST_TIMEOUT_S}"]
    arguments += ["-p", "tests.mutants.hits", *_NOT_RUN]
    arguments += [argument for test in slow for argument in ("--deselect", test)]
    settings = {
        "source_paths": ["companion"],
        "only_mutate": [f"companion/{room}/*"],
        "also_copy": _COPIED,
        "do_not_mutate_patterns": _NOT_MUTATED,
        "pytest_add_cli_args": arguments,
        "pytest_add_cli_args_test_selection": tests,
    }
    lines = [f"{key} = {_toml(value)}" for key, value in settings.items()]
    lines.append(f"timeout_constant = {_PATIENCE_S}")
    (folder / "preloaded.txt").write_text("\n".join(_PRELOADED))
    lines.append('process_isolation = "forkserver"')
    lines.append('forkserver_warmup = "import"')
    lines.append('preload_modules_file = "preloaded.txt"')
    project = (_ROOT / "pyproject.toml").read_text()
    (folder / "pyproject.toml").write_text("\n".join([project, "[tool.mutmut]", *lines, ""]))


def _toml(strings: list[str]) -> str:
    escaped = (string.replace("\\", "\\\\").replace('"', '\\"') for string in strings)
    return "[" + ", ".join(f'"{string}"' for string in escaped) + "]"


def _mutmut(folder: Path, *arguments: str, may_fail: bool = False) -> None:
    """Run it; what it draws on a terminal goes to a file."""
    with (folder / "mutmut.log").open("w") as log:
        command = [sys.executable, "-m", "mutmut", *arguments]
        failed = subprocess.run(command, cwd=folder, stdout=log, stderr=log, check=False).returncode
        if failed and not may_fail:
            raise SystemExit(f"mutmut failed: {log.name}")


def _mutants(folder: Path) -> list[Mutant]:
    """All mutants with what became of them."""
    command = [sys.executable, "-m", "mutmut", "results", "--all", "true"]
    listing = subprocess.run(command, cwd=folder, check=True, capture_output=True, text=True).stdout
    lines = (line.strip().partition(": ") for line in listing.splitlines())
    return [Mutant(name, status) for name, _, status in lines]


def _find_changes(folder: Path, mutants: list[Mutant]) -> None:
    from mutmut.configuration import reset_config  # noqa: PLC0415  an extra
    from mutmut.mutation.diff_apply import get_diff_for_mutant  # noqa: PLC0415

    reset_config()  # it keeps the configuration of the first room

    with contextlib.chdir(folder):
        for mutant in mutants:
            if not mutant.killed:
                mutant.diff = get_diff_for_mutant(mutant.name)


if __name__ == "__main__":
    sys.exit(main())
