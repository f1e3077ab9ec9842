"""What differs between autopilot families, as one interface.

A personality has numbers and words of its own, and puts its family's rules together (`Rules`) from
what every vehicle has (`VehicleParts`). Nothing else of the mock knows a family.
"""

from collections.abc import Callable, Collection, Mapping
from typing import Any, NamedTuple, Protocol

from sitl_mock.autopilot.commander import Commander, ModeControl
from sitl_mock.autopilot.commands import Commands
from sitl_mock.autopilot.events import Event, EventKind
from sitl_mock.autopilot.land_detector import LandDetector
from sitl_mock.autopilot.motion_telemetry import Builder
from sitl_mock.autopilot.parameter_protocol import ParameterProtocol
from sitl_mock.autopilot.parameters import Parameter, ParameterTable
from sitl_mock.autopilot.setpoints import OffboardStream
from sitl_mock.autopilot.state import Mode, State
from sitl_mock.config.settings import VehicleSettings
from sitl_mock.link.framing import Message
from sitl_mock.link.link import Link, StreamSchedule
from sitl_mock.physics.geodesy import Origin
from sitl_mock.physics.vehicle import Vehicle


class Identity(NamedTuple):
    """What AUTOPILOT_VERSION says."""

    capabilities: int
    flight_sw_version: int
    middleware_sw_version: int
    os_sw_version: int
    flight_custom_version: tuple[int, ...]


class VehicleParts(NamedTuple):
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

    events: Mapping[EventKind, Event]
    """What is said on each occasion."""
    boot_mode: Mode
    system_id_parameter: str
    """Name of the parameter that holds the vehicle's system id."""
    any_component: bool
    """Whether messages to any component of this system are taken."""
    unsigned_links: Collection[str]
    """Links on which frames without a signature are obeyed though signing is on."""
    parameters: tuple[Parameter, ...]
    """All parameters with their defaults."""

    def with_defaults(self, section: dict[str, Any]) -> dict[str, Any]:
        """Return the ``mock:`` section, completed by the defaults of this autopilot."""

    def slot_us(self, settings: VehicleSettings) -> int:
        """Return the period of the turns in which telemetry leaves, us."""

    def streams(self, link: str, settings: VehicleSettings) -> StreamSchedule:
        """Return the streams of a link (``companion`` or ``gcs``) as they are at boot."""

    def mode_of(self, custom_mode: int) -> Mode | None:
        """Return the mode a custom_mode means, None if there is no such mode."""

    def rules(self, parts: VehicleParts) -> Rules:
        """Put the family's rules together for one vehicle."""
