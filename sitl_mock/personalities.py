"""The autopilot families that the mock can be."""

from sitl_mock.ardupilot.personality import ArduPilot
from sitl_mock.autopilot.personality import Personality
from sitl_mock.px4.personality import Px4
from sitl_mock.settings import MockSettings


def personality_of(settings: MockSettings) -> Personality:
    """Return the personality that the settings name."""
    return Px4() if settings.autopilot == "px4" else ArduPilot()
