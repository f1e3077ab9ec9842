"""The MAV_CMDs that ArduCopter executes in its own way, and their results."""

from math import isfinite

from pymavlink.dialects.v20 import development as dialect

from sitl_mock.ardupilot.commander import ArduPilotCommander
from sitl_mock.ardupilot.modes import MODES_BY_NUMBER
from sitl_mock.ardupilot.texts import INFO, ArduPilotAnnouncer
from sitl_mock.autopilot.commander import ACCEPTED, DENIED, FAILED
from sitl_mock.autopilot.commands import Command, Commands
from sitl_mock.autopilot.motion_telemetry import Builder
from sitl_mock.autopilot.state import Mode, State
from sitl_mock.link.framing import Message
from sitl_mock.link.link import Link

_STREAM_GROUPS: dict[int, tuple[int, ...]] = {
    dialect.MAV_DATA_STREAM_RAW_SENSORS: (
        dialect.MAVLINK_MSG_ID_RAW_IMU,
        dialect.MAVLINK_MSG_ID_SCALED_PRESSURE,
    ),
    dialect.MAV_DATA_STREAM_EXTENDED_STATUS: (
        dialect.MAVLINK_MSG_ID_SYS_STATUS,
        dialect.MAVLINK_MSG_ID_MISSION_CURRENT,
        dialect.MAVLINK_MSG_ID_GPS_RAW_INT,
    ),
    dialect.MAV_DATA_STREAM_RC_CHANNELS: (
        dialect.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW,
        dialect.MAVLINK_MSG_ID_RC_CHANNELS,
    ),
    dialect.MAV_DATA_STREAM_POSITION: (
        dialect.MAVLINK_MSG_ID_GLOBAL_POSITION_INT,
        dialect.MAVLINK_MSG_ID_LOCAL_POSITION_NED,
    ),
    dialect.MAV_DATA_STREAM_EXTRA1: (dialect.MAVLINK_MSG_ID_ATTITUDE,),
    dialect.MAV_DATA_STREAM_EXTRA2: (dialect.MAVLINK_MSG_ID_VFR_HUD,),
    dialect.MAV_DATA_STREAM_EXTRA3: (
        dialect.MAVLINK_MSG_ID_SYSTEM_TIME,
        193,  # EKF_STATUS_REPORT, of ArduPilot's own dialect
        dialect.MAVLINK_MSG_ID_VIBRATION,
        dialect.MAVLINK_MSG_ID_BATTERY_STATUS,
    ),
}
"""The messages of each group of REQUEST_DATA_STREAM (recorded, as far as the mock has them)."""


class ArduPilotCommands(Commands):
    """The `Commands` of ArduCopter.

    Args:
        builders: message id -> builder of the message, for requests.
        announce: sends the reason for a refusal.
    """

    def __init__(
        self,
        state: State,
        commander: ArduPilotCommander,
        builders: dict[int, Builder],
        announce: ArduPilotAnnouncer,
    ) -> None:
        super().__init__(state, commander, builders)
        self._announce = announce
        self.handlers |= {
            dialect.MAV_CMD_DO_SET_MODE: self._set_mode,
            dialect.MAV_CMD_NAV_TAKEOFF: lambda command, _: commander.take_off(
                command.parameters[6]
            ),
            dialect.MAV_CMD_NAV_LAND: lambda *_: commander.request_mode(Mode.LAND),
            dialect.MAV_CMD_NAV_RETURN_TO_LAUNCH: lambda *_: commander.request_mode(Mode.RTL),
            dialect.MAV_CMD_NAV_LOITER_UNLIM: lambda *_: commander.request_mode(Mode.LOITER),
            dialect.MAV_CMD_SET_MESSAGE_INTERVAL: self._set_interval,
        }

    def request_data_stream(self, message: Message, link: Link) -> None:
        """REQUEST_DATA_STREAM: start or stop a message group on this link; group 0 means all."""
        requested_group = message.req_stream_id
        groups = (
            _STREAM_GROUPS.values()
            if requested_group == 0
            else [_STREAM_GROUPS.get(requested_group, ())]
        )
        rate_hz = message.req_message_rate
        interval_us = 1e6 / rate_hz if message.start_stop and rate_hz else -1.0
        for group in groups:
            for message_id in group:
                link.streams.set_interval(message_id, interval_us, self._state.time_us)

    def _set_mode(self, command: Command, _: Link) -> int:
        base_mode, custom_mode = command.parameters[:2]
        if not isfinite(base_mode) or not isfinite(custom_mode):
            return DENIED
        if not int(base_mode) & dialect.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED:
            return DENIED
        mode = MODES_BY_NUMBER.get(int(custom_mode))
        return FAILED if mode is None else self._commander.request_mode(mode)

    def _set_interval(self, command: Command, link: Link) -> int:
        if not all(map(isfinite, command.parameters[:2])):
            return DENIED
        message_id, interval_us = int(command.parameters[0]), command.parameters[1]
        if message_id in self._builders:
            refusal = link.streams.set_interval(message_id, interval_us, self._state.time_us)
        else:
            refusal = f"No ap_message for mavlink id ({message_id})"
        if refusal is None:
            return ACCEPTED
        self._announce.say(refusal, INFO)
        return DENIED
