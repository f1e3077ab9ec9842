"""What a message that arrives does: a table from message to handler."""

from collections.abc import Callable
from math import nan

from pymavlink.dialects.v20 import development as dialect

from sitl_mock.commander import Commander
from sitl_mock.commands import DENIED, Command, Commands
from sitl_mock.link import Link
from sitl_mock.offboard import OffboardStream
from sitl_mock.parameter_protocol import ParameterProtocol
from sitl_mock.parameters import ParameterTable
from sitl_mock.personality import Personality
from sitl_mock.setpoints import Setpoint, attitude_setpoint, position_setpoint
from sitl_mock.state import State
from sitl_mock.wire import Message

_COMPONENT = 1
_BROADCAST = 0
_PLACE_FRAMES = frozenset(
    {
        dialect.MAV_FRAME_GLOBAL,
        dialect.MAV_FRAME_GLOBAL_INT,
        dialect.MAV_FRAME_GLOBAL_RELATIVE_ALT,
        dialect.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT,
    }
)


class Receiver:
    """Hands every message meant for this autopilot to its handler.

    Args:
        state: the autopilot's state.
        commander: hears heartbeats and mode requests.
        commands: carries out commands.
        protocol: answers parameter messages.
        parameters: the autopilot's parameters.
        stream: takes setpoints.
        personality: translates custom modes.
        system_id: this vehicle's.
    """

    def __init__(
        self,
        state: State,
        commander: Commander,
        commands: Commands,
        protocol: ParameterProtocol,
        parameters: ParameterTable,
        stream: OffboardStream,
        personality: Personality,
        system_id: int,
    ) -> None:
        self.clock_ns: Callable[[], int] = lambda: state.shown_us * 1000
        self._state = state
        self._commander = commander
        self._commands = commands
        self._stream = stream
        self._parameters = parameters
        self._personality = personality
        self._system_id = system_id
        self._handlers: dict[str, Callable[[Message, Link], None]] = {
            "SET_ATTITUDE_TARGET": self._attitude_target,
            "SET_POSITION_TARGET_LOCAL_NED": self._position_target,
            "HEARTBEAT": self._heartbeat,
            "COMMAND_LONG": self._command_long,
            "COMMAND_INT": self._command_int,
            "SET_MODE": self._set_mode,
            "TIMESYNC": self._timesync,
            "PING": self._ping,
            "PARAM_REQUEST_LIST": protocol.request_list,
            "PARAM_REQUEST_READ": protocol.request_read,
            "PARAM_SET": protocol.set,
            "MISSION_REQUEST_LIST": self._mission_list,
        }

    def handle(self, message: Message, link: Link) -> None:
        """Handle one message; what is not for this autopilot, or unknown, is ignored in silence."""
        handler = self._handlers.get(message.get_type())
        if handler is not None and self._for_us(message):
            handler(message, link)

    def _for_us(self, message: Message) -> bool:
        system = getattr(message, "target_system", _BROADCAST)
        component = getattr(message, "target_component", _BROADCAST)
        return system in (_BROADCAST, self._system_id) and component in (_BROADCAST, _COMPONENT)

    def _attitude_target(self, message: Message, _: Link) -> None:
        self._accept(attitude_setpoint(message))

    def _position_target(self, message: Message, _: Link) -> None:
        self._accept(position_setpoint(message))

    def _accept(self, setpoint: Setpoint | None) -> None:
        if setpoint is not None and self._parameters["MAV_FWDEXTSP"]:
            self._stream.accept(setpoint, self._state.time_us)

    def _heartbeat(self, message: Message, link: Link) -> None:
        if message.get_srcSystem() == self._system_id and message.get_srcComponent() == _COMPONENT:
            return
        link.gcs_heard = link.gcs_heard or message.type == dialect.MAV_TYPE_GCS
        self._commander.failsafe.heard(message.type)

    def _command_long(self, message: Message, link: Link) -> None:
        parameters = tuple(getattr(message, f"param{number}") for number in range(1, 8))
        self._run(Command(message.command, parameters), message, link)

    def _command_int(self, message: Message, link: Link) -> None:
        x, y = float(message.x), float(message.y)
        if message.frame in _PLACE_FRAMES:
            x, y = (nan if value == 2**31 - 1 else value / 1e7 for value in (x, y))
        parameters = (
            message.param1,
            message.param2,
            message.param3,
            message.param4,
            x,
            y,
            message.z,
        )
        self._run(Command(message.command, parameters), message, link)

    def _set_mode(self, message: Message, link: Link) -> None:
        custom = message.custom_mode
        mode = self._personality.mode_of(custom)
        valid = mode and message.base_mode & dialect.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
        result = self._commander.request_mode(mode) if mode and valid else DENIED
        self._acknowledge(dialect.MAV_CMD_DO_SET_MODE, result, message, link)

    def _run(self, command: Command, message: Message, link: Link) -> None:
        self._acknowledge(command.number, self._commands.run(command, link), message, link)

    def _acknowledge(self, command: int, result: int, message: Message, link: Link) -> None:
        link.send(
            dialect.MAVLink_command_ack_message(
                command,
                result,
                target_system=message.get_srcSystem(),
                target_component=message.get_srcComponent(),
            )
        )

    def _timesync(self, message: Message, link: Link) -> None:
        if message.tc1 == 0:
            link.send(dialect.MAVLink_timesync_message(self.clock_ns(), message.ts1))

    def _ping(self, message: Message, link: Link) -> None:
        if message.target_system == _BROADCAST and message.target_component == _BROADCAST:
            link.send(
                dialect.MAVLink_ping_message(
                    message.time_usec,
                    message.seq,
                    message.get_srcSystem(),
                    message.get_srcComponent(),
                )
            )

    def _mission_list(self, message: Message, link: Link) -> None:
        link.send(
            dialect.MAVLink_mission_count_message(
                message.get_srcSystem(), message.get_srcComponent(), 0, message.mission_type
            )
        )
