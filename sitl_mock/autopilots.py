"""The registry of autopilots: the only module that imports their folders."""

from collections.abc import Mapping

from sitl_mock.ardupilot.autopilot import ArduPilot
from sitl_mock.autopilot.interface import Autopilot
from sitl_mock.px4.autopilot import Px4

AUTOPILOTS: Mapping[str, Autopilot] = {"px4": Px4(), "ardupilot": ArduPilot()}
"""``mock.autopilot`` -> autopilot."""
