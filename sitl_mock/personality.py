"""What differs between autopilot families, as one interface: numbers, rules of the link, words."""

from collections.abc import Mapping
from enum import Enum, auto
from typing import NamedTuple, Protocol

from sitl_mock.modes import Mode
from sitl_mock.parameters import Parameter


class Occasion(Enum):
    """Something that an autopilot tells of."""

    ARMED = auto()
    ARMING_DENIED = auto()
    PREFLIGHT_FAIL = auto()
    DISARMED_BY_COMMAND = auto()
    DISARMED_BY_LANDING = auto()
    DISARMED_ON_GROUND = auto()
    DISARMED_AFTER_CRASH = auto()
    DISARM_DENIED = auto()
    MODE_DENIED = auto()
    DEFAULT_TAKEOFF_ALTITUDE = auto()
    TAKEOFF_DETECTED = auto()
    LANDING_DETECTED = auto()
    OFFBOARD_LOST = auto()
    OFFBOARD_REGAINED = auto()
    GCS_LOST = auto()
    COMPANION_LOST = auto()
    COMPANION_REGAINED = auto()
    POSITION_LOST = auto()
    BATTERY_LOW = auto()
    BATTERY_CRITICAL = auto()
    BATTERY_EMERGENCY = auto()
    PILOT_TOOK_OVER = auto()
    PILOT_LOST = auto()


class Event(NamedTuple):
    """How an autopilot tells of an occasion: words for a ground station, an id for machines.

    ``text`` may have one ``{}`` for a detail; ``severity`` is MAV_SEVERITY; ``event_id`` 0 = words
    only; ``arguments`` are the event's bytes.
    """

    text: str
    severity: int
    event_id: int = 0
    arguments: bytes = b""


class Identity(NamedTuple):
    """What AUTOPILOT_VERSION says."""

    capabilities: int
    flight_sw_version: int
    middleware_sw_version: int
    os_sw_version: int
    flight_custom_version: tuple[int, ...]


class Personality(Protocol):
    """One autopilot family."""

    autopilot_type: int
    """MAV_AUTOPILOT."""
    identity: Identity
    modes_by_command: Mapping[tuple[int, int], Mode]
    """(main mode, sub mode) of DO_SET_MODE -> mode."""
    events: Mapping[Occasion, Event]
    """What is said on each occasion."""

    def parameters(self) -> tuple[Parameter, ...]:
        """Return all parameters with their defaults."""

    def stream_rates(self, link: str) -> Mapping[int, float]:
        """Return message id -> Hz at boot on a link (``companion`` or ``gcs``)."""

    def custom_mode(self, mode: Mode) -> int:
        """Return HEARTBEAT.custom_mode."""

    def mode_of(self, custom_mode: int) -> Mode | None:
        """Return the mode a custom_mode means, None if there is no such mode."""

    def base_mode(self, mode: Mode, *, armed: bool, attitude_controlled: bool) -> int:
        """Return HEARTBEAT.base_mode; ``attitude_controlled`` tells apart OFFBOARD's forms."""

    def standard_mode(self, mode: Mode) -> int:
        """Return CURRENT_MODE.standard_mode (MAV_STANDARD_MODE)."""
