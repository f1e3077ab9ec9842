"""The simulated PX4: its numbers and its behaviour (recorded from PX4 main, SIH)."""

from collections.abc import Collection
from random import Random
from typing import Any

from pymavlink.dialects.v20 import development as dialect

from sitl_mock.autopilot.interface import Behaviour, Identity, VehicleParts
from sitl_mock.autopilot.land_detector import LandDetector
from sitl_mock.autopilot.motion_telemetry import MotionTelemetry
from sitl_mock.autopilot.parameter_protocol import ParameterProtocol
from sitl_mock.autopilot.parameters import BytewiseEncoding
from sitl_mock.autopilot.state import Mode
from sitl_mock.config.settings import VehicleSettings
from sitl_mock.link.link import StreamSchedule
from sitl_mock.px4.arming import ArmingChecks
from sitl_mock.px4.commander import Px4Commander
from sitl_mock.px4.commands import Px4Commands
from sitl_mock.px4.event_log import Announcer, EventLog
from sitl_mock.px4.health import HealthReport
from sitl_mock.px4.mode_control import Px4ModeControl
from sitl_mock.px4.modes import MODES_BY_COMMAND
from sitl_mock.px4.parameters import PX4_PARAMETERS
from sitl_mock.px4.streams import SLOT_PERIOD_US, Px4Streams
from sitl_mock.px4.system_telemetry import Px4SystemTelemetry

POSITION_VALID_FRACTION = 0.7
"""Share of ``prearm_delay_s`` after which the position becomes valid (recorded: 3.2 s)."""
LANDED_AFTER_US = 1_100_000
"""Time of ground contact with low thrust after which the vehicle has landed, us (measured)."""

_COMPANION_RATES: dict[int, float] = {
    dialect.MAVLINK_MSG_ID_HEARTBEAT: 1.0,
    dialect.MAVLINK_MSG_ID_ATTITUDE: 100.0,
    dialect.MAVLINK_MSG_ID_ATTITUDE_QUATERNION: 50.0,
    dialect.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: 50.0,
    dialect.MAVLINK_MSG_ID_HIGHRES_IMU: 50.0,
    dialect.MAVLINK_MSG_ID_LOCAL_POSITION_NED: 30.0,
    dialect.MAVLINK_MSG_ID_ODOMETRY: 30.0,
    dialect.MAVLINK_MSG_ID_TIMESYNC: 10.0,
    dialect.MAVLINK_MSG_ID_ALTITUDE: 10.0,
    dialect.MAVLINK_MSG_ID_ATTITUDE_TARGET: 10.0,
    dialect.MAVLINK_MSG_ID_POSITION_TARGET_LOCAL_NED: 10.0,
    dialect.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW: 10.0,
    dialect.MAVLINK_MSG_ID_VFR_HUD: 10.0,
    dialect.MAVLINK_MSG_ID_GPS_RAW_INT: 8.0,
    dialect.MAVLINK_MSG_ID_SYS_STATUS: 5.0,
    dialect.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: 5.0,
    dialect.MAVLINK_MSG_ID_ESTIMATOR_STATUS: 1.0,
    dialect.MAVLINK_MSG_ID_SYSTEM_TIME: 1.0,
    dialect.MAVLINK_MSG_ID_PING: 1.0,
    dialect.MAVLINK_MSG_ID_MISSION_CURRENT: 1.0,
    dialect.MAVLINK_MSG_ID_BATTERY_STATUS: 0.5,
    dialect.MAVLINK_MSG_ID_HOME_POSITION: 0.5,
    dialect.MAVLINK_MSG_ID_CURRENT_MODE: 0.5,
    dialect.MAVLINK_MSG_ID_VIBRATION: 0.5,
}

_GCS_RATES: dict[int, float] = {
    **_COMPANION_RATES,
    dialect.MAVLINK_MSG_ID_ATTITUDE: 15.0,
    dialect.MAVLINK_MSG_ID_ATTITUDE_QUATERNION: 10.0,
    dialect.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: 10.0,
    dialect.MAVLINK_MSG_ID_HIGHRES_IMU: 1.0,
    dialect.MAVLINK_MSG_ID_LOCAL_POSITION_NED: 10.0,
    dialect.MAVLINK_MSG_ID_ODOMETRY: 1.0,
    dialect.MAVLINK_MSG_ID_TIMESYNC: 1.0,
    dialect.MAVLINK_MSG_ID_ALTITUDE: 2.0,
    dialect.MAVLINK_MSG_ID_ATTITUDE_TARGET: 2.0,
    dialect.MAVLINK_MSG_ID_POSITION_TARGET_LOCAL_NED: 2.0,
    dialect.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW: 2.0,
    dialect.MAVLINK_MSG_ID_VFR_HUD: 4.0,
    dialect.MAVLINK_MSG_ID_GPS_RAW_INT: 1.0,
    dialect.MAVLINK_MSG_ID_SYS_STATUS: 1.0,
    dialect.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: 1.0,
}


class Px4:
    """The `Autopilot` PX4."""

    boot_mode = Mode.LOITER
    accepts_any_component = False
    system_id_parameter = "MAV_SYS_ID"
    unsigned_links: Collection[str] = ()
    parameters = PX4_PARAMETERS
    identity = Identity(
        capabilities=0xE8FF,
        flight_sw_version=18022464,
        middleware_sw_version=18022464,
        os_sw_version=101854463,
        flight_custom_version=(0, 0, 0, 245, 216, 154, 203, 253),
        board_version=1,
        uid=5283920058631409231,
    )

    def with_defaults(self, section: dict[str, Any]) -> dict[str, Any]:
        """Return the ``mock:`` section as it is: the general defaults are PX4's."""
        return section

    def slot_period_us(self, settings: VehicleSettings) -> int:
        """Return the slot period at the configured inner loop rate, us."""
        return SLOT_PERIOD_US[settings.inner_loop_hz]

    def streams(self, link: str, settings: VehicleSettings) -> StreamSchedule:
        """Return the stream schedule of a link, with the rates recorded on this link."""
        lockstep = settings.lockstep.enabled
        rates = dict(_GCS_RATES if link == "gcs" else _COMPANION_RATES)
        if lockstep and link == "companion":
            del rates[dialect.MAVLINK_MSG_ID_SYSTEM_TIME]  # in lockstep this message is the beacon
        exact_rates = lockstep if settings.exact_rates is None else settings.exact_rates
        skips_slots = settings.inner_loop_hz == 250 and not exact_rates
        return Px4Streams(rates, random=Random(f"{settings.seed}/{link}") if skips_slots else None)

    def mode_of(self, custom_mode: int) -> Mode | None:
        """Return the mode of a custom_mode (see `modes.custom_mode`), None if there is none."""
        return MODES_BY_COMMAND.get((custom_mode >> 16 & 0xFF, custom_mode >> 24 & 0xFF))

    def behaviour(self, parts: VehicleParts) -> Behaviour:
        """Build PX4's behaviour for one vehicle."""
        state, parameters, vehicle = parts.state, parts.parameters, parts.vehicle
        events = EventLog(state, parts.links)
        announce = Announcer(parts.links, events)
        control = Px4ModeControl(state, parameters, parts.stream)
        health = HealthReport(state, events, parts.ready_us)
        checks = ArmingChecks(state, parameters, parts.stream, health, parts.ready_us)
        commander = Px4Commander(state, parameters, control, parts.stream, announce, checks)
        builders = {
            **MotionTelemetry(state, vehicle, parts.origin, parts.slips).builders(),
            **Px4SystemTelemetry(
                state, parts.origin, self.identity, vehicle, parts.stream
            ).builders(),
        }
        return Behaviour(
            control,
            commander,
            Px4Commands(state, commander, builders, parts.origin),
            ParameterProtocol(parameters, BytewiseEncoding()),
            LandDetector(
                state,
                announce,
                hover_thrust=lambda: parameters["MPC_THR_HOVER"],
                landed_after_us=LANDED_AFTER_US,
                is_taking_off=lambda: state.mode is Mode.TAKEOFF and not control.takeoff_reached,
            ),
            builders,
            handlers={
                "MANUAL_CONTROL": commander.receive_manual_control,
                "REQUEST_EVENT": events.answer_request,
            },
            position_valid_from_us=POSITION_VALID_FRACTION * parts.ready_us,
            position_timeout_us=lambda: parameters["EKF2_NOAID_TOUT"],
        )
