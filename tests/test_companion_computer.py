"""docs/companion-computer.md and its unit: what can be checked of them without such a computer."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from companion.config import Config
from companion.config.computer import RealtimeConfig
from companion.files.yaml_file import parse

DOCS = Path(__file__).parents[1] / "docs"
UNIT = (DOCS / "companion.service").read_text()
PAGE = (DOCS / "companion-computer.md").read_text()


@pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="no systemd here")
def test_systemd_takes_the_unit(tmp_path):
    unit = tmp_path / "companion.service"
    unit.write_text(UNIT.replace("/opt/companion/bin/companion", sys.executable))
    command = ["systemd-analyze", "verify", "--man=no", str(unit)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


def test_the_unit_grants_every_priority_that_may_be_asked_for():
    (highest,) = (
        limit.le
        for limit in RealtimeConfig.model_fields["priority"].metadata
        if hasattr(limit, "le")
    )
    assert f"LimitRTPRIO={highest}\n" in UNIT
    assert f"rtprio {highest}`" in PAGE


def test_the_unit_waits_longer_for_the_end_than_handing_back_and_landing_may_take():
    allowed = int(re.search(r"TimeoutStopSec=(\d+)", UNIT).group(1))
    assert allowed > Config().flight.landing_timeout_s + 2 * 20.0


def test_the_configuration_on_the_page_is_one():
    snippet = PAGE.split("```yaml\nrealtime:\n")[1].split("```")[0]
    config = parse("realtime:\n" + snippet, "the page", Config)
    assert list(yaml.safe_load("realtime:\n" + snippet)["realtime"]) == list(
        RealtimeConfig.model_fields
    )
    assert config.realtime.scheduler == "fifo"


def test_the_bytes_on_the_page_are_those_on_the_wire():
    from pymavlink.dialects.v20 import common as dialect  # noqa: PLC0415

    mav = dialect.MAVLink(None, 1, 1)
    sample = dialect.MAVLink_attitude_quaternion_message(10**9, 0.5, 0.5, 0.5, 0.5, 1.0, 1.0, 1.0)
    setpoint = dialect.MAVLink_set_attitude_target_message(
        10**9, 1, 1, 128, [1.0, 0.0, 0.0, 0.0], 0.1, 0.2, 0.3, 0.5
    )
    sizes = tuple(len(message.pack(mav)) for message in (sample, setpoint))
    assert sizes == (44, 51)
    assert "A sample has 44 bytes and a setpoint 51" in PAGE
