"""Degrees, milliseconds and percent become SI units in one place."""

import math
import re
from pathlib import Path

import pytest

from companion.config import Config

COMPANION = Path(__file__).parents[1] / "companion"
ROOMS = ("attitude", "control", "flight", "guidance", "nmpc", "preflight", "safety", "vehicle")


@pytest.mark.parametrize("room", ROOMS)
def test_no_room_that_flies_converts_a_key(room):
    key = re.compile(r"(radians\([^)]*_deg|(1e-3|_MS|0\.001) \* [\w.]*_ms\b|_percent / 100)")
    for file in (COMPANION / room).rglob("*.py"):
        for line in file.read_text().splitlines():
            of_a_message = "time_boot_ms" in line or "_stamps_ms" in line
            assert of_a_message or not key.search(line), f"{file.name}: {line}"


def test_the_keys_are_read_in_si_units():
    config = Config()
    limits, deadman, safety = config.limits, config.deadman, config.safety
    assert limits.max_tilt == pytest.approx(math.radians(limits.max_tilt_deg))
    assert limits.max_yaw_rate == pytest.approx(math.radians(limits.max_yaw_rate_deg_s))
    assert limits.min_battery == pytest.approx(limits.min_battery_percent / 100)
    assert deadman.silence_limit == pytest.approx(deadman.silence_limit_ms / 1000)
    assert safety.max_reset_angle == pytest.approx(math.radians(safety.max_reset_deg))


@pytest.mark.parametrize("percent", range(101))
def test_a_percentage_is_the_share_that_the_vehicle_reports(percent):
    limits = Config.model_validate({"limits": {"min_battery_percent": percent}}).limits
    assert limits.min_battery == percent / 100.0  # as SYS_STATUS is read: no ulp between them


def test_what_is_not_known_of_an_axis_stays_unknown():
    known = Config.model_validate({"vehicle": {"lag_ms": 40.0, "dead_time_ms": 20.0}}).vehicle
    roll, pitch = known.axes["roll"], known.axes["pitch"]
    assert (roll.lag, roll.dead_time, roll.acceleration_limit) == (0.04, 0.02, None)
    assert pitch == roll
    axes = {f"{axis}{key}" for axis in ("", "pitch_", "yaw_") for key in ("lag", "dead_time")}
    assert known.response.keys() == axes
    assert Config().vehicle.response == {}
