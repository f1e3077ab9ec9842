"""docs/architecture.md tells the truth about files and functions, and none of them is long."""

import ast
import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "architecture.md").read_text()
PATHS = sorted(set(re.findall(r"`((?:companion|sitl_mock)/[\w/]*(?:\.py)?)`", PAGE)))
FUNCTIONS = re.findall(r"`(companion/[\w/]+\.py)`\s·\s`(\w+)`", PAGE)


@pytest.mark.parametrize("path", PATHS)
def test_what_is_named_exists(path):
    assert (ROOT / path).exists()


@pytest.mark.parametrize(("path", "function"), FUNCTIONS)
def test_the_function_is_in_the_file(path, function):
    assert re.search(rf"def {function}\(", (ROOT / path).read_text())


def test_every_package_is_on_the_map():
    packages = {path.parent.name for path in (ROOT / "companion").glob("*/__init__.py")}
    assert {package for package in packages if f"`companion/{package}/`" not in PAGE} == set()
    assert len(FUNCTIONS) > 8


def test_the_map_is_in_the_order_of_the_imports():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    contracts = project["tool"]["importlinter"]["contracts"]
    layers = next(one for one in contracts if one["name"] == "Imports point one way")["layers"]
    layer = {name: k for k, names in enumerate(layers) for name in re.findall(r"\.(\w+)", names)}
    shown = [layer[name] for name in re.findall(r"^\| `companion/(\w+)/`", PAGE, re.MULTILINE)]
    assert len(shown) > 20
    assert shown == sorted(shown)


MOST_LINES_OF_A_FILE, MOST_LINES_OF_A_FUNCTION = 250, 50
SOURCES = sorted(
    path for room in ("companion", "sitl_mock") for path in (ROOT / room).rglob("*.py")
)


def statements(node):
    """The statements within a node; expressions, most of what is written, hold no `def`."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.stmt | ast.excepthandler | ast.match_case):
            yield child
            yield from statements(child)


def long_functions(path):
    """Name and lines, its docstring included, of each function that is too long."""
    for node in statements(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            lines = node.end_lineno - node.lineno + 1
            if lines > MOST_LINES_OF_A_FUNCTION:
                yield f"{path.relative_to(ROOT)}: {node.name}: {lines} lines"


def test_no_file_is_long():
    lines = {path: len(path.read_text("utf-8").splitlines()) for path in SOURCES}
    assert len(lines) > 400
    assert {path: n for path, n in lines.items() if n > MOST_LINES_OF_A_FILE} == {}


def test_no_function_is_long():
    assert [told for path in SOURCES for told in long_functions(path)] == []
