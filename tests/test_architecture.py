"""docs/architecture.md tells the truth about files and functions."""

import re
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


def test_every_room_is_on_the_map():
    rooms = {path.parent.name for path in (ROOT / "companion").glob("*/__init__.py")}
    assert {room for room in rooms if f"`companion/{room}/`" not in PAGE} <= {"mavsdk_link"}
    assert len(FUNCTIONS) > 8
