"""Dispatches received messages to their handlers."""

from collections.abc import Callable
from math import nan

from pymavlink.dialects.v20 import development as dialect

from sitl_mock.autopilot.commander import DENIED
from sitl_mock.autopilot.commands import Command
from sitl_mock.autopilot.interface import Autopilot, Behaviour
from sitl_mock.autopilot.mission_protocol import MissionProtocol
from sitl_mock.autopilot.state import State
from sitl_mock.link.framing import Message
from sitl_mock.link.link import Link

_AUTOPILOT_COMPONENT = 1
_BROADCAST = 0
_GLOBAL_FRAMES = frozenset(
    {
        dialect.MAV_FRAME_GLOBAL,
        dialect.MAV_FRAME_GLOBAL_INT,
        dialect.MAV_FRAME_GLOBAL_RELATIVE_ALT,
        dialect.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT,
        dialect.MAV_FRAME_GLOBAL_TERRAIN_ALT,
        dialect.MAV_FRAME_GLOBAL_TERRAIN_ALT_INT,
    }
)


class Receiver:
    """Calls the handler of every message addressed to this autopilot.

    Args:
        autopilot: decodes custom modes, and defines which components the autopilot answers for.
    """

    def __init__(
        self, state: State, behaviour: Behaviour, autopilot: Autopilot, system_id: int
    ) -> None:
        self.clock_ns: Callable[[], int] = lambda: state.stamp_us * 1000
        """Clock for answers to TIMESYNC: vehicle time, ns."""
        self._commander = commander = behaviour.commander
        self._commands = behaviour.commands
        self._autopilot = autopilot
        self._system_id = system_id
        self._handlers: dict[str, Callable[[Message, Link], None]] = {
            "SET_ATTITUDE_TARGET": lambda message, _: commander.receive_setpoint(message),
            "SET_POSITION_TARGET_LOCAL_NED": lambda message, _: commander.receive_setpoint(message),
            "HEARTBEAT": self._handle_heartbeat,
            "COMMAND_LONG": self._handle_command_long,
            "COMMAND_INT": self._handle_command_int,
            "SET_MODE": self._handle_set_mode,
            "TIMESYNC": self._answer_timesync,
            "PING": self._answer_ping,
            "PARAM_REQUEST_LIST": behaviour.parameter_protocol.request_list,
            "PARAM_REQUEST_READ": behaviour.parameter_protocol.request_read,
            "PARAM_SET": behaviour.parameter_protocol.set,
            **MissionProtocol().handlers,
            **behaviour.handlers,
        }

    def handle(self, message: Message, link: Link) -> None:
        """Handle one message.

        Messages are ignored if they are unknown, not accepted by signing, or for another system or
        (on PX4) another component.
        """
        if not link.accepts(message):
            return
        link.client_has_sent = True
        handler = self._handlers.get(message.get_type())
        if handler is not None and self._is_for_us(message):
            handler(message, link)

    def _is_for_us(self, message: Message) -> bool:
        system = getattr(message, "target_system", _BROADCAST)
        component = getattr(message, "target_component", _BROADCAST)
        return system in (_BROADCAST, self._system_id) and (
            component in (_BROADCAST, _AUTOPILOT_COMPONENT) or self._autopilot.accepts_any_component
        )

    def _handle_heartbeat(self, message: Message, link: Link) -> None:
        if (
            message.get_srcSystem() == self._system_id
            and message.get_srcComponent() == _AUTOPILOT_COMPONENT
        ):
            return
        link.gcs_has_sent = link.gcs_has_sent or message.type == dialect.MAV_TYPE_GCS
        self._commander.receive_heartbeat(message)

    def _handle_command_long(self, message: Message, link: Link) -> None:
        parameters = tuple(getattr(message, f"param{number}") for number in range(1, 8))
        self._run(Command(message.command, parameters), message, link)

    def _handle_command_int(self, message: Message, link: Link) -> None:
        x, y = float(message.x), float(message.y)
        if message.frame in _GLOBAL_FRAMES:
            x, y = (nan if value == 2**31 - 1 else value / 1e7 for value in (x, y))
        parameters_1_to_4 = message.param1, message.param2, message.param3, message.param4
        self._run(Command(message.command, (*parameters_1_to_4, x, y, message.z)), message, link)

    def _handle_set_mode(self, message: Message, link: Link) -> None:
        custom_mode = message.custom_mode
        mode = self._autopilot.mode_of(custom_mode)
        mode_is_valid = mode and message.base_mode & dialect.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
        result = self._commander.request_mode(mode) if mode and mode_is_valid else DENIED
        self._acknowledge(dialect.MAV_CMD_DO_SET_MODE, result, message, link)

    def _run(self, command: Command, message: Message, link: Link) -> None:
        self._acknowledge(command.command_id, self._commands.run(command, link), message, link)

    def _acknowledge(self, command: int, result: int, message: Message, link: Link) -> None:
        link.send(
            dialect.MAVLink_command_ack_message(
                command,
                result,
                target_system=message.get_srcSystem(),
                target_component=message.get_srcComponent(),
            )
        )

    def _answer_timesync(self, message: Message, link: Link) -> None:
        if message.tc1 == 0:
            link.send(dialect.MAVLink_timesync_message(self.clock_ns(), message.ts1))

    def _answer_ping(self, message: Message, link: Link) -> None:
        if message.target_system == _BROADCAST and message.target_component == _BROADCAST:
            link.send(
                dialect.MAVLink_ping_message(
                    message.time_usec,
                    message.seq,
                    message.get_srcSystem(),
                    message.get_srcComponent(),
                )
            )
