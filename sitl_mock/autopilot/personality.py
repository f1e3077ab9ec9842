"""What differs between autopilot families, as one interface.

A personality has numbers and words of its own, and puts its family's rules together (`Rules`) from
what every vehicle has (`Parts`). Nothing else of the mock knows a family.
"""

from __future__ import annotations

from enum import Enum, auto
from typing import TYPE_CHECKING, NamedTuple, Protocol

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Mapping

    from sitl_mock.autopilot.commander import Commander
    from sitl_mock.autopilot.commands import Commands
    from sitl_mock.autopilot.land_detector import LandDetector
    from sitl_mock.autopilot.mode_control import ModeControl
    from sitl_mock.autopilot.modes import Mode
    from sitl_mock.autopilot.motion_telemetry import Builder
    from sitl_mock.autopilot.offboard import OffboardStream
    from sitl_mock.autopilot.parameter_protocol import ParameterProtocol
    from sitl_mock.autopilot.parameters import ParameterTable
    from sitl_mock.autopilot.state import State
    from sitl_mock.link.framing import Message
    from sitl_mock.link.link import Link
    from sitl_mock.link.streams import StreamSchedule
    from sitl_mock.physics.geodesy import Origin
    from sitl_mock.physics.vehicle import Vehicle
    from sitl_mock.settings import MockSettings


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
    LANDING_COMMANDED = auto()
    DISARMED_BY_FAILSAFE = auto()
    FAILSAFE = auto()
    FAILSAFE_UNNAMED = auto()
    FAILSAFE_HOLD = auto()
    FAILSAFE_WARNING = auto()
    GCS_LOST = auto()
    GCS_REGAINED = auto()
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
    only; ``arguments`` are the event's bytes; ``internal`` is its severity in the vehicle's own
    log, None = the same.
    """

    text: str
    severity: int
    event_id: int = 0
    arguments: bytes = b""
    internal: int | None = None


class Identity(NamedTuple):
    """What AUTOPILOT_VERSION says."""

    capabilities: int
    flight_sw_version: int
    middleware_sw_version: int
    os_sw_version: int
    flight_custom_version: tuple[int, ...]


class Parts(NamedTuple):
    """What every vehicle has, whatever its autopilot."""

    state: State
    parameters: ParameterTable
    vehicle: Vehicle
    stream: OffboardStream
    origin: Origin
    links: list[Link]
    ready_us: int
    """Vehicle time from which arming is possible."""


class Rules(NamedTuple):
    """What an autopilot family does, put together for one vehicle."""

    control: ModeControl
    commander: Commander
    commands: Commands
    parameter_protocol: ParameterProtocol
    land_detector: LandDetector
    builders: dict[int, Builder]
    """Message id -> builder."""
    handlers: dict[str, Callable[[Message, Link], None]]
    """Handlers of messages that only this family takes, by the message's name."""
    converged_us: float
    """Vehicle time at which the position becomes valid."""
    position_timeout_us: Callable[[], float]
    """How long the position stays valid without GPS."""


class Personality(Protocol):
    """One autopilot family."""

    events: Mapping[Occasion, Event]
    """What is said on each occasion."""
    boot_mode: Mode
    system_id_parameter: str
    """Name of the parameter that holds the vehicle's system id."""
    any_component: bool
    """Whether messages to any component of this system are taken."""
    unsigned_links: Collection[str]
    """Links on which frames without a signature are obeyed though signing is on."""

    def slot_us(self, settings: MockSettings) -> int:
        """Return the period of the turns in which telemetry leaves, us."""

    def streams(self, link: str, settings: MockSettings) -> StreamSchedule:
        """Return the streams of a link (``companion`` or ``gcs``) as they are at boot."""

    def mode_of(self, custom_mode: int) -> Mode | None:
        """Return the mode a custom_mode means, None if there is no such mode."""

    def rules(self, parts: Parts) -> Rules:
        """Put the family's rules together for one vehicle."""
