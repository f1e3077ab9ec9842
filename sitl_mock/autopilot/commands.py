"""The MAV_CMDs that all autopilots execute alike, and their results."""

from collections.abc import Callable
from math import isfinite
from typing import NamedTuple

from pymavlink.dialects.v20 import development as dialect

from sitl_mock.autopilot.commander import (
    ACCEPTED,
    DENIED,
    TEMPORARILY_REJECTED,
    UNSUPPORTED,
    Commander,
)
from sitl_mock.autopilot.motion_telemetry import Builder
from sitl_mock.autopilot.state import State
from sitl_mock.link.link import Link

FORCE_MAGIC = 21196.0
"""param2 of COMPONENT_ARM_DISARM that skips the checks."""


class Command(NamedTuple):
    """A command with its seven parameters; 5 and 6 are in degrees if they are a position."""

    command_id: int
    parameters: tuple[float, float, float, float, float, float, float]


Handler = Callable[[Command, Link], int]
"""Executes a command received on a link; returns its MAV_RESULT."""


class Commands:
    """Executes commands.

    Args:
        builders: message id -> builder of the message, for requests.
    """

    def __init__(self, state: State, commander: Commander, builders: dict[int, Builder]) -> None:
        self._state = state
        self._commander = commander
        self._builders = builders
        self.handlers: dict[int, Handler] = {
            dialect.MAV_CMD_COMPONENT_ARM_DISARM: self._arm_disarm,
            dialect.MAV_CMD_RUN_PREARM_CHECKS: self._run_checks,
            dialect.MAV_CMD_GET_MESSAGE_INTERVAL: self._get_interval,
            dialect.MAV_CMD_REQUEST_MESSAGE: self._request_message,
            dialect.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES: (
                lambda _, link: self.send(dialect.MAVLINK_MSG_ID_AUTOPILOT_VERSION, link)
            ),
        }
        """MAV_CMD -> handler; an autopilot adds its own."""

    def run(self, command: Command, link: Link) -> int:
        """Execute one command received on a link, and return its MAV_RESULT."""
        handler = self.handlers.get(command.command_id)
        return UNSUPPORTED if handler is None else handler(command, link)

    def send(self, message_id: int, link: Link) -> int:
        """Send a message once on a link, and return a MAV_RESULT.

        DENIED if there is no such message, or nothing valid to send.
        """
        builder = self._builders.get(message_id)
        message = None if builder is None else builder()
        if message is None:
            return DENIED
        link.send(message)
        return ACCEPTED

    def _arm_disarm(self, command: Command, _: Link) -> int:
        arm, magic = command.parameters[:2]
        force = magic == FORCE_MAGIC
        if arm == 1.0:
            return self._commander.arm(force=force)
        if arm == 0.0:
            return self._commander.disarm(force=force)
        return DENIED

    def _run_checks(self, _: Command, __: Link) -> int:
        if self._state.armed:
            return TEMPORARILY_REJECTED
        self._commander.announce_problem()
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
        return self.send(int(message_id), link) if isfinite(message_id) else DENIED
