"""What each MAV_CMD does, and its result."""

from collections.abc import Callable
from math import isfinite, isnan
from typing import NamedTuple

from pymavlink.dialects.v20 import development as dialect

from sitl_mock.commander import ACCEPTED, TEMPORARILY_REJECTED, Commander
from sitl_mock.geodesy import Geodetic, Origin, to_local
from sitl_mock.link import Link
from sitl_mock.modes import Mode
from sitl_mock.personality import Personality
from sitl_mock.quaternion import Vector
from sitl_mock.state import State
from sitl_mock.telemetry import Builder

UNSUPPORTED = int(dialect.MAV_RESULT_UNSUPPORTED)
DENIED = int(dialect.MAV_RESULT_DENIED)
FORCE_MAGIC = 21196.0
"""param2 of COMPONENT_ARM_DISARM that skips the checks."""

_PROTOCOL_VERSION_ID = 300
_PROTOCOL_VERSION_CRC = 217
_PROTOCOL_VERSION = bytes((200, 0, 100, 0, 200, 0)) + bytes(16)
_CHANGE_MODE = 1
"""Flag in param2 of DO_REPOSITION."""


class Command(NamedTuple):
    """A command with its seven parameters; 5 and 6 in degrees when they are a place."""

    number: int
    parameters: tuple[float, float, float, float, float, float, float]


class Commands:
    """Carries out commands.

    Args:
        state: the autopilot's state.
        commander: changes arming and modes.
        personality: translates mode numbers.
        origin: of the local frame.
        builders: message id -> builder, for requests.
    """

    def __init__(
        self,
        state: State,
        commander: Commander,
        personality: Personality,
        origin: Origin,
        builders: dict[int, Builder],
    ) -> None:
        self._state = state
        self._commander = commander
        self._personality = personality
        self._origin = origin
        self._builders = builders
        self._handlers: dict[int, Callable[[Command, Link], int]] = {
            dialect.MAV_CMD_COMPONENT_ARM_DISARM: self._arm_disarm,
            dialect.MAV_CMD_DO_SET_MODE: self._set_mode,
            dialect.MAV_CMD_NAV_TAKEOFF: self._takeoff,
            dialect.MAV_CMD_NAV_LAND: lambda *_: self._commander.request_mode(Mode.LAND),
            dialect.MAV_CMD_NAV_RETURN_TO_LAUNCH: (
                lambda *_: self._commander.request_mode(Mode.RTL)
            ),
            dialect.MAV_CMD_NAV_LOITER_UNLIM: (
                lambda *_: self._commander.request_mode(Mode.LOITER)
            ),
            dialect.MAV_CMD_DO_REPOSITION: self._reposition,
            dialect.MAV_CMD_DO_SET_HOME: self._set_home,
            dialect.MAV_CMD_SET_MESSAGE_INTERVAL: self._set_interval,
            dialect.MAV_CMD_GET_MESSAGE_INTERVAL: self._get_interval,
            dialect.MAV_CMD_REQUEST_MESSAGE: self._request_message,
            dialect.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES: (
                lambda _, link: self._send(dialect.MAVLINK_MSG_ID_AUTOPILOT_VERSION, link)
            ),
            dialect.MAV_CMD_REQUEST_PROTOCOL_VERSION: (
                lambda _, link: self._send(_PROTOCOL_VERSION_ID, link)
            ),
        }

    def run(self, command: Command, link: Link) -> int:
        """Carry out one command that came on a link, and return its MAV_RESULT."""
        handler = self._handlers.get(command.number)
        return UNSUPPORTED if handler is None else handler(command, link)

    def _arm_disarm(self, command: Command, _: Link) -> int:
        arm, magic = command.parameters[:2]
        force = magic == FORCE_MAGIC
        if arm == 1.0:
            return self._commander.arm(force=force)
        if arm == 0.0:
            return self._commander.disarm(force=force)
        return DENIED

    def _set_mode(self, command: Command, _: Link) -> int:
        base, main, sub = command.parameters[:3]
        if not all(map(isfinite, (base, main, sub))):
            return DENIED
        if not int(base) & dialect.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED:
            return TEMPORARILY_REJECTED
        mode = self._personality.modes_by_command.get((int(main), int(sub)))
        return TEMPORARILY_REJECTED if mode is None else self._commander.request_mode(mode)

    def _takeoff(self, command: Command, _: Link) -> int:
        altitude_amsl = command.parameters[6]
        takeoff_z = None if isnan(altitude_amsl) else self._origin.altitude_m - altitude_amsl
        return self._commander.request_mode(Mode.TAKEOFF, takeoff_z=takeoff_z)

    def _reposition(self, command: Command, _: Link) -> int:
        flags = command.parameters[1]
        changes = isfinite(flags) and int(flags) & _CHANGE_MODE
        if not changes and self._state.mode is not Mode.LOITER:
            return TEMPORARILY_REJECTED
        return self._commander.request_mode(Mode.LOITER, hold=self._place(command))

    def _place(self, command: Command) -> Vector:
        """Return the local position that parameters 5 to 7 name; what is NaN stays as it is."""
        latitude, longitude, altitude = command.parameters[4:]
        north, east, down = self._state.estimate.position_ned
        if isfinite(latitude) and isfinite(longitude):
            north, east, _ = to_local(self._origin, Geodetic(latitude, longitude, 0.0))
        if isfinite(altitude):
            down = self._origin.altitude_m - altitude
        return (north, east, down)

    def _set_home(self, command: Command, _: Link) -> int:
        state = self._state
        if command.parameters[0] == 1.0:
            state.home_ned = state.estimate.position_ned
        else:
            if not all(map(isfinite, command.parameters[4:])):
                return DENIED
            place = Geodetic(*command.parameters[4:])
            state.home_ned = to_local(self._origin, place)
        state.home_q = state.estimate.q
        state.home_set_at_us = state.time_us
        return ACCEPTED

    def _set_interval(self, command: Command, link: Link) -> int:
        message_id, interval_us = command.parameters[:2]
        if isfinite(message_id) and isfinite(interval_us):
            link.streams.set_interval(int(message_id), interval_us, self._state.time_us)
        return ACCEPTED

    def _get_interval(self, command: Command, link: Link) -> int:
        message_id = command.parameters[0]
        if not 0.0 <= message_id <= 65535.0:
            return DENIED
        interval = min(link.streams.interval(int(message_id)), 2**31 - 1)
        link.send(dialect.MAVLink_message_interval_message(int(message_id), interval))
        return ACCEPTED

    def _request_message(self, command: Command, link: Link) -> int:
        message_id = command.parameters[0]
        return self._send(int(message_id), link) if isfinite(message_id) else DENIED

    def _send(self, message_id: int, link: Link) -> int:
        if message_id == _PROTOCOL_VERSION_ID:
            link.send_raw(_PROTOCOL_VERSION_ID, _PROTOCOL_VERSION_CRC, _PROTOCOL_VERSION)
            return ACCEPTED
        builder = self._builders.get(message_id)
        message = None if builder is None else builder()
        if message is None:
            return DENIED
        link.send(message)
        return ACCEPTED
