"""The MAV_CMDs that PX4 executes in its own way, and their results."""

from math import isfinite, isnan

from pymavlink.dialects.v20 import development as dialect

from sitl_mock.autopilot.commander import ACCEPTED, DENIED, FAILED, TEMPORARILY_REJECTED
from sitl_mock.autopilot.commands import Command, Commands
from sitl_mock.autopilot.motion_telemetry import Builder
from sitl_mock.autopilot.state import Mode, State
from sitl_mock.link.link import Link
from sitl_mock.physics.geodesy import Geodetic, to_local
from sitl_mock.physics.quaternion import Vector
from sitl_mock.px4.commander import Px4Commander
from sitl_mock.px4.modes import MODES_BY_COMMAND

_PROTOCOL_VERSION_ID = 300
_PROTOCOL_VERSION_CRC = 217
_PROTOCOL_VERSION = bytes((200, 0, 100, 0, 200, 0)) + bytes(16)
"""Payload of PROTOCOL_VERSION: version 200, smallest 100, largest 200, no hashes."""
_CHANGE_MODE_FLAG = 1
"""Flag in param2 of DO_REPOSITION: change to LOITER if in another mode."""


class Px4Commands(Commands):
    """The `Commands` of PX4.

    Args:
        builders: message id -> builder of the message, for requests.
    """

    def __init__(
        self, state: State, commander: Px4Commander, builders: dict[int, Builder], origin: Geodetic
    ) -> None:
        super().__init__(state, commander, builders)
        self._px4_commander = commander
        self._origin = origin
        self.handlers |= {
            dialect.MAV_CMD_DO_SET_MODE: self._set_mode,
            dialect.MAV_CMD_NAV_TAKEOFF: self._takeoff,
            dialect.MAV_CMD_NAV_LAND: lambda *_: commander.land(),
            dialect.MAV_CMD_NAV_RETURN_TO_LAUNCH: lambda *_: commander.request_mode(Mode.RTL),
            dialect.MAV_CMD_NAV_LOITER_UNLIM: lambda *_: commander.request_mode(Mode.LOITER),
            dialect.MAV_CMD_DO_REPOSITION: self._reposition,
            dialect.MAV_CMD_DO_SET_HOME: self._set_home,
            dialect.MAV_CMD_SET_MESSAGE_INTERVAL: self._set_interval,
            dialect.MAV_CMD_REQUEST_PROTOCOL_VERSION: (
                lambda _, link: self.send(_PROTOCOL_VERSION_ID, link)
            ),
        }

    def send(self, message_id: int, link: Link) -> int:
        """Send a message (or PROTOCOL_VERSION, which the dialect lacks); return a MAV_RESULT."""
        if message_id == _PROTOCOL_VERSION_ID:
            link.send_raw(_PROTOCOL_VERSION_ID, _PROTOCOL_VERSION_CRC, _PROTOCOL_VERSION)
            return ACCEPTED
        return super().send(message_id, link)

    def _set_mode(self, command: Command, _: Link) -> int:
        base_mode, main_mode, sub_mode = command.parameters[:3]
        if not all(map(isfinite, (base_mode, main_mode, sub_mode))):
            return DENIED
        if not int(base_mode) & dialect.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED:
            return TEMPORARILY_REJECTED
        mode = MODES_BY_COMMAND.get((int(main_mode), int(sub_mode)))
        return TEMPORARILY_REJECTED if mode is None else self._px4_commander.request_mode(mode)

    def _takeoff(self, command: Command, _: Link) -> int:
        altitude_amsl = command.parameters[6]
        takeoff_z = None if isnan(altitude_amsl) else self._origin.altitude_m - altitude_amsl
        return self._px4_commander.request_mode(Mode.TAKEOFF, takeoff_z=takeoff_z)

    def _reposition(self, command: Command, _: Link) -> int:
        flags = command.parameters[1]
        mode_change_requested = isfinite(flags) and int(flags) & _CHANGE_MODE_FLAG
        if not mode_change_requested and self._state.mode is not Mode.LOITER:
            return TEMPORARILY_REJECTED
        return self._px4_commander.request_mode(Mode.LOITER, hold_position=self._position(command))

    def _position(self, command: Command) -> Vector:
        """Return the position in parameters 5 to 7, m NED; NaN keeps the present value."""
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
            home = Geodetic(*command.parameters[4:])
            state.home_ned = to_local(self._origin, home)
        state.home_q = state.estimate.q
        state.home_set_at_us = state.time_us
        return ACCEPTED

    def _set_interval(self, command: Command, link: Link) -> int:
        message_id, interval_us = command.parameters[:2]
        if not (isfinite(message_id) and isfinite(interval_us)):
            return ACCEPTED
        refusal = link.streams.set_interval(int(message_id), interval_us, self._state.time_us)
        return ACCEPTED if refusal is None else FAILED
