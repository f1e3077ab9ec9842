"""The interface of a simulated autopilot: everything in which PX4 and ArduPilot differ.

An autopilot has its own numbers and texts, and builds its `Behaviour` from the parts that every
vehicle has (`VehicleParts`).
"""

from collections.abc import Callable, Collection
from typing import Any, NamedTuple, Protocol

from sitl_mock.autopilot.commander import Commander, ModeControl
from sitl_mock.autopilot.commands import Commands
from sitl_mock.autopilot.land_detector import LandDetector
from sitl_mock.autopilot.motion_telemetry import Builder
from sitl_mock.autopilot.parameter_protocol import ParameterProtocol
from sitl_mock.autopilot.parameters import Parameter, ParameterTable
from sitl_mock.autopilot.setpoints import OffboardStream
from sitl_mock.autopilot.stamp_slips import StampSlips
from sitl_mock.autopilot.state import Mode, State
from sitl_mock.config.settings import VehicleSettings
from sitl_mock.link.framing import Message
from sitl_mock.link.link import Link, StreamSchedule
from sitl_mock.physics.geodesy import Geodetic
from sitl_mock.physics.vehicle import Vehicle


class Identity(NamedTuple):
    """Content of AUTOPILOT_VERSION."""

    capabilities: int
    flight_sw_version: int
    middleware_sw_version: int
    os_sw_version: int
    flight_custom_version: tuple[int, ...]
    board_version: int = 0
    uid: int = 0
    """Hardware id; 0: only `uid2` tells it."""
    uid2: tuple[int, ...] = (0,) * 18


class VehicleParts(NamedTuple):
    """The parts of a vehicle that do not depend on its autopilot."""

    state: State
    parameters: ParameterTable
    vehicle: Vehicle
    stream: OffboardStream
    origin: Geodetic
    links: list[Link]
    ready_us: int
    """Vehicle time at which the boot ends (`mock.prearm_delay_s`), us. Until then ArduPilot refuses
    arming in modes that need a position, and PX4 refuses it in all modes."""
    slips: StampSlips
    """Lag of the time stamp of LOCAL_POSITION_NED behind the true time."""


class Behaviour(NamedTuple):
    """The behaviour of an autopilot, built for one vehicle."""

    control: ModeControl
    commander: Commander
    commands: Commands
    parameter_protocol: ParameterProtocol
    land_detector: LandDetector
    builders: dict[int, Builder]
    """Message id -> builder."""
    handlers: dict[str, Callable[[Message, Link], None]]
    """Message name -> handler, for messages that only this autopilot handles."""
    position_valid_from_us: float
    """Vehicle time at which the position becomes valid, us."""
    position_timeout_us: Callable[[], float]
    """Time for which the position stays valid without GPS, us."""


class Autopilot(Protocol):
    """A simulated autopilot, such as PX4: its numbers, and how to build its `Behaviour`."""

    boot_mode: Mode
    system_id_parameter: str
    accepts_any_component: bool
    """Whether the autopilot handles messages to any component of its system."""
    unsigned_links: Collection[str]
    """Links on which the autopilot accepts unsigned frames although signing is on."""
    parameters: tuple[Parameter, ...]

    def with_defaults(self, section: dict[str, Any]) -> dict[str, Any]:
        """Return the ``mock:`` section, completed by the defaults of this autopilot."""

    def slot_period_us(self, settings: VehicleSettings) -> int:
        """Return the period of the slots in which telemetry is sent without lockstep, us."""

    def streams(self, link: str, settings: VehicleSettings) -> StreamSchedule:
        """Return the stream schedule of a link (``companion`` or ``gcs``) at boot."""

    def mode_of(self, custom_mode: int) -> Mode | None:
        """Return the mode of a custom_mode, None if there is no such mode."""

    def behaviour(self, parts: VehicleParts) -> Behaviour:
        """Build the behaviour for one vehicle."""
