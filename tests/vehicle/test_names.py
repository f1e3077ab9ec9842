"""Only `vehicle/px4`, `vehicle/ardupilot` and the registry name an autopilot in code."""

import ast
import re
from pathlib import Path

COMPANION = Path(__file__).parents[2] / "companion"
NAMED = re.compile(r"px4|ardupilot(?!mega)", re.IGNORECASE)
"""pymavlink calls its dialect ardupilotmega, whatever autopilot one speaks to."""
MAY_NAME = ("vehicle/px4", "vehicle/ardupilot", "vehicle/registry.py")
TEXTS = ("study", "bench", "cli", "demo.py", "report", "testing", "tuning/flights.py")
"""Rooms whose texts tell a user of autopilots, or that fly a mock vehicle by its name."""


def names_in(source):
    """Identifiers and strings of a module that name an autopilot; docstrings may."""
    if not NAMED.search(source):
        return  # to parse every module takes seconds
    tree = ast.parse(source)
    prose = {
        id(node.value)
        for node in ast.walk(tree)
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
    }
    for node in ast.walk(tree):
        words = [getattr(node, field, None) for field in ("id", "attr", "name", "arg", "module")]
        if isinstance(node, ast.Constant) and id(node) not in prose:
            words.append(node.value)
        yield from (word for word in words if isinstance(word, str) and NAMED.search(word))


def test_no_other_module_names_an_autopilot():
    found = {
        f"{path.relative_to(COMPANION)}: {name}"
        for path in COMPANION.rglob("*.py")
        if not str(path.relative_to(COMPANION)).startswith((*MAY_NAME, *TEXTS))
        for name in names_in(path.read_text(encoding="utf-8"))
    }
    assert not found


def test_a_name_in_code_is_found_and_one_in_prose_is_not():
    for code in (
        "if family == 'px4': pass",
        "def is_ardupilot(): pass",
        "state.px4_mode",
        "f(PX4=1)",
    ):
        assert list(names_in(code)), code
    assert not list(names_in('"""PX4 does so."""\nx = 1\n"""ArduPilot: another."""\n# PX4\n'))
