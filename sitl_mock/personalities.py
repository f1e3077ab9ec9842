"""The registry of autopilots: the only module that imports their folders."""

from collections.abc import Mapping

from sitl_mock.ardupilot.personality import ArduPilot
from sitl_mock.autopilot.personality import Personality
from sitl_mock.px4.personality import Px4

PERSONALITIES: Mapping[str, Personality] = {"px4": Px4(), "ardupilot": ArduPilot()}
"""``mock.autopilot`` -> personality."""
