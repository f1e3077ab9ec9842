"""The simulated ArduCopter: its numbers and its behaviour (recorded from 4.7.0-dev)."""

from collections.abc import Collection, Iterable

from pymavlink.dialects.v20 import development as dialect

from sitl_mock.ardupilot.boot import INITIALISED_S, RECORDED_READY_S, Boot, Notifier
from sitl_mock.ardupilot.commander import ArduPilotCommander
from sitl_mock.ardupilot.commands import ArduPilotCommands
from sitl_mock.ardupilot.defaults import (
    ARDUPILOT_PARAMETERS,
    ARDUPILOT_TYPES,
    with_ardupilot_defaults,
)
from sitl_mock.ardupilot.guided import Guided
from sitl_mock.ardupilot.mode_control import ArduPilotModeControl
from sitl_mock.ardupilot.modes import MODES_BY_NUMBER
from sitl_mock.ardupilot.motion_telemetry import ArduPilotMotionTelemetry
from sitl_mock.ardupilot.streams import ArduPilotStreams
from sitl_mock.ardupilot.system_telemetry import ArduPilotSystemTelemetry
from sitl_mock.ardupilot.texts import ArduPilotAnnouncer
from sitl_mock.autopilot.commands import Commands
from sitl_mock.autopilot.interface import Behaviour, Identity, VehicleParts
from sitl_mock.autopilot.land_detector import LandDetector
from sitl_mock.autopilot.motion_telemetry import Builder
from sitl_mock.autopilot.parameter_protocol import ParameterProtocol
from sitl_mock.autopilot.parameters import FloatEncoding
from sitl_mock.autopilot.state import Mode
from sitl_mock.config.settings import VehicleSettings
from sitl_mock.link.link import Link, StreamSchedule

LANDED_AFTER_US = 1_000_000
"""Time of ground contact with low thrust after which the vehicle has landed, us."""
POSITION_TIMEOUT_US = 10_000_000
"""Time for which the position stays valid without GPS, us; not measured."""
DEFAULT_LOOP_HZ = 400.0
"""Rate of the main loop if SCHED_LOOP_RATE is not configured."""
_HOME_MESSAGES = (dialect.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN, dialect.MAVLINK_MSG_ID_HOME_POSITION)
_BOOT_RATES = {dialect.MAVLINK_MSG_ID_HEARTBEAT: 1.0, dialect.MAVLINK_MSG_ID_TIMESYNC: 0.1}
"""Message id -> rate from boot on, Hz."""


class ArduPilot:
    """The `Autopilot` ArduPilot (ArduCopter)."""

    boot_mode = Mode.STABILIZE
    accepts_any_component = True
    system_id_parameter = "MAV_SYSID"
    unsigned_links: Collection[str] = ("companion",)
    parameters = ARDUPILOT_PARAMETERS
    with_defaults = staticmethod(with_ardupilot_defaults)
    identity = Identity(
        capabilities=64495,
        flight_sw_version=0x04070000,
        middleware_sw_version=0,
        os_sw_version=0,
        flight_custom_version=tuple(b"12f6aa4e"),
        uid2=tuple(b"0123456789abcdef0\0"),  # as ArduPilot's simulator, whose `uid` is 0
    )

    def slot_period_us(self, settings: VehicleSettings) -> int:
        """Return the period of the main loop, us."""
        return round(1e6 / settings.parameters.get("SCHED_LOOP_RATE", DEFAULT_LOOP_HZ))

    def streams(self, link: str, settings: VehicleSettings) -> StreamSchedule:
        """Return the stream schedule of a link; it begins with HEARTBEAT and TIMESYNC only."""
        boot_duration_s = settings.prearm_delay_s * INITIALISED_S / RECORDED_READY_S
        return ArduPilotStreams(
            _BOOT_RATES,
            loop_us=self.slot_period_us(settings),
            booting_until_us=boot_duration_s * 1e6,
        )

    def mode_of(self, custom_mode: int) -> Mode | None:
        """Return the mode of a custom_mode, None if the mock does not have it."""
        return MODES_BY_NUMBER.get(custom_mode)

    def behaviour(self, parts: VehicleParts) -> Behaviour:
        """Build ArduCopter's behaviour for one vehicle."""
        state, parameters, links = parts.state, parts.parameters, parts.links
        announce = ArduPilotAnnouncer(links)
        protocol = ParameterProtocol(parameters, FloatEncoding(ARDUPILOT_TYPES))
        guided = Guided()
        control = ArduPilotModeControl(state, parameters, guided, parts.vehicle.throttle)
        notifier = Notifier(
            announce,
            send_home=lambda: _send_messages(commands, _HOME_MESSAGES, links),
            send_parameter=lambda name: protocol.send_changed(
                name, [link for link in links if link.client_has_sent]
            ),
        )
        boot = Boot(state, notifier, ready_us=parts.ready_us, elevation=parts.origin.altitude_m)
        commander = ArduPilotCommander(
            state, parameters, parts.vehicle, control, guided, parts.stream, notifier, boot
        )
        builders = self._builders(parts, boot)
        commands = ArduPilotCommands(state, commander, builders, announce)
        return Behaviour(
            control,
            commander,
            commands,
            protocol,
            LandDetector(
                state,
                announce,
                hover_thrust=control.hover_throttle,
                landed_after_us=LANDED_AFTER_US,
                is_taking_off=lambda: control.taking_off,
            ),
            builders,
            handlers={"REQUEST_DATA_STREAM": commands.request_data_stream},
            position_valid_from_us=parts.ready_us,
            position_timeout_us=lambda: POSITION_TIMEOUT_US,
        )

    def _builders(self, parts: VehicleParts, boot: Boot) -> dict[int, Builder]:
        motion = ArduPilotMotionTelemetry(parts.state, parts.vehicle, parts.origin, parts.slips)
        system = ArduPilotSystemTelemetry(
            parts.state, parts.origin, self.identity, parts.vehicle, boot
        )
        return motion.builders() | system.builders()


def _send_messages(commands: Commands, messages: Iterable[int], links: Iterable[Link]) -> None:
    for link in links:
        for message_id in messages:
            commands.send(message_id, link)
