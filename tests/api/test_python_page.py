"""docs/python.md: its programs fly as they stand, on the mock vehicle in memory."""

import re
import textwrap
from functools import partial
from types import SimpleNamespace

import pytest

from companion.config.files import changed, load
from companion.testing import connect, run
from tests.flight.fly import CONFIGS, LOOP_HZ, QuickVehicle

PAGE = (CONFIGS.parent / "docs/python.md").read_text("utf-8")
(PROGRAM,) = re.findall(r'^```python title="my_flight\.py"\n(.*?)^```$', PAGE, re.M | re.S)
(OWN_GUIDANCE,) = re.findall(r"^```python\n(async with vehicle.*?)^```$", PAGE, re.M | re.S)
GO_TO, FOLLOW = re.findall(r"^ +await vehicle\.(?:go_to|follow)\(.*\n", PROGRAM, re.M)


def flown(program: str, config: str) -> str:
    """What the program prints, flown with this configuration file."""
    mock, said = QuickVehicle("px4"), []

    def connected(path, arm):
        assert (path, arm) == ("configs/mock-px4.yaml", True)
        changes = {"flight": {"arm": arm}, "link": {"attitude_rate_hz": float(LOOP_HZ)}}
        changes["thrust"] = {"hover_thrust": 0.49}
        return connect(changed(load(CONFIGS / config), changes, "arm"), mock)

    given = {"companion": SimpleNamespace(connect=connected, run=partial(run, mock))}
    given["print"] = lambda *words: said.append(" ".join(map(str, words)))
    exec(program.replace("import companion\n", ""), given)
    assert not mock.state()["crashed"]
    assert not mock.state()["armed"]
    return "\n".join(said)


@pytest.mark.parametrize("config", ["mock-px4.yaml", "px4.yaml"])
def test_the_first_program_flies_within_the_limits_of_the_shipped_files(config, monkeypatch):
    monkeypatch.chdir(CONFIGS.parent)
    assert flown(PROGRAM, config).startswith("ok {'position_rms_m': 0.0")


def test_guidance_of_ones_own_stands_in_place_of_a_call():
    block = textwrap.indent(OWN_GUIDANCE.replace("seconds=10.0", "seconds=1.0"), " " * 8)
    program = PROGRAM.replace(FOLLOW, block).replace(GO_TO, "")
    assert "control.accelerate" in program
    assert flown(program, "mock-px4.yaml").startswith("ok ")
