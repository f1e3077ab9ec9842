"""The flight modes of both autopilots, as HEARTBEAT tells them."""

from typing import NamedTuple

PX4_MODES = {
    "ALTCTL": (2, 0),
    "POSCTL": (3, 0),
    "TAKEOFF": (4, 2),
    "LOITER": (4, 3),
    "RTL": (4, 5),
    "LAND": (4, 6),
    "DESCEND": (4, 20),
    "OFFBOARD": (6, 0),
}
"""Main mode and sub mode by name."""
ARDUPILOT_MODES = {
    "STABILIZE": 0,
    "ALT_HOLD": 2,
    "GUIDED": 4,
    "LOITER": 5,
    "RTL": 6,
    "LAND": 9,
    "BRAKE": 17,
}
"""`custom_mode` by name."""


class Told(NamedTuple):
    """What the autopilot told of itself."""

    time: float
    custom_mode: int
    base_mode: int
    status: int

    @property
    def armed(self) -> bool:
        return bool(self.base_mode & 128)


def mode_name(autopilot: str, told: Told) -> str:
    """The name of a mode, or its number; in GUIDED, ArduPilot may obey body rates."""
    mode = told.custom_mode
    if autopilot == "px4":
        key = (mode >> 16 & 255, mode >> 24 & 255)
        return next((name for name, each in PX4_MODES.items() if each == key), str(key))
    name = next((name for name, each in ARDUPILOT_MODES.items() if each == mode), str(mode))
    by_rates = name == "GUIDED" and told.armed and not told.base_mode & 8
    return "GUIDED (body rates)" if by_rates else name
