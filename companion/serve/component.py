"""This program as a MAVLink component on the clients' network.

The component sends heartbeats, status texts, named values, and acknowledgements of commands.
"""

import asyncio
import time
from collections.abc import Callable

from companion.files.ascii_text import ascii_for
from companion.mavlink.framing import Frame, build_frame
from companion.mavlink.messages import Message, dialect, encode
from companion.mavlink.settings import MAV_TYPE_ONBOARD_CONTROLLER, LinkSettings
from companion.mavlink.texts import MAX_TEXT_ID, status_texts
from companion.serve.mode_requests import MISSION_ITEMS, command_in
from companion.serve.network.addresses import Address
from companion.serve.network.client import Client
from companion.serve.network.network import Network
from companion.serve.network.permission import COMMAND_IDS

_HEARTBEAT_PERIOD = 1.0
_MAX_TEXT_LENGTH = 200
"""Number of characters after which a text is cut."""
_TEXT_REPEAT_PERIOD = 5.0
"""Shortest time between two equal texts to the same client, s."""
_MAX_ANSWERS = 10
"""Largest number of texts to one client in `_TEXT_REPEAT_PERIOD`. Without this limit, each
refused setpoint could cause a text, because the text may contain the setpoint's numbers."""
_AUTOPILOT_INVALID, _STATE_ACTIVE, _MAVLINK_VERSION = 8, 4, 3

WARNING, NOTICE = dialect.MAV_SEVERITY_WARNING, dialect.MAV_SEVERITY_NOTICE


class Component:
    """The MAVLink component of the companion computer: sends to clients, and answers commands.

    Args:
        to_vehicle: sends a message over the link, so that it reaches ground stations connected to
            the autopilot.
    """

    def __init__(
        self, settings: LinkSettings, network: Network, to_vehicle: Callable[[Message], bool]
    ) -> None:
        self._settings, self._network, self._to_vehicle = settings, network, to_vehicle
        self._loop = asyncio.get_running_loop()
        self._own_address = Address(settings.source_system, settings.source_component)
        self._sequence = self._text_id = 0
        self._start_time = time.monotonic()
        self._text_sent_times: dict[tuple[Client | None, str], float] = {}

    async def run(self) -> None:
        """Send heartbeats until cancelled."""
        while True:
            self._network.send(self._frame(_heartbeat()))
            await asyncio.sleep(_HEARTBEAT_PERIOD)

    def tell(self, text: str, severity: int = NOTICE) -> None:
        """Send a text to all clients, and over the link to stations connected to the autopilot.

        A text that was sent within the last 5 s is not sent again.
        """
        if self._note_unless_repeated(None, text):
            for message in self._text_messages(text, severity):
                self._network.send(self._frame(message))
                self._to_vehicle(message)

    def answer(self, client: Client, text: str, severity: int = WARNING) -> None:
        """Send a text to one client, such as the reason of a refusal.

        Within 5 s a text is not sent twice, and not more than ten texts are sent.
        """
        if self._note_unless_repeated(client, text):
            for message in self._text_messages(text, severity):
                self._network.send_to(client, self._frame(message))

    def send_value(self, name: str, value: float) -> None:
        """Send a NAMED_VALUE_FLOAT to all clients; the name has at most 10 characters."""
        boot_ms = round((time.monotonic() - self._start_time) * 1e3) & 0xFFFFFFFF
        message = dialect.MAVLink_named_value_float_message(boot_ms, name.encode(), value)
        self._network.send(self._frame(message))

    def acknowledge(self, client: Client, frame: Frame, result: int, sender: Address) -> None:
        """Answer a client's command or mission item; other messages have no answer.

        Args:
            client: sender of the frame.
            frame: COMMAND_LONG, COMMAND_INT, SET_MODE, MISSION_ITEM or any other frame.
            result: MAV_RESULT of the command; a mission item is always denied.
            sender: source address of the answer. Clients accept an answer only from the component
                to which they sent the command.
        """
        message = _acknowledgement(frame, result)
        if message is not None:
            self._network.send_to(client, self._frame(message, sender))

    def on_own_frame(self, client: Client, frame: Frame) -> None:
        """Refuse every command to our component; ignore other frames."""
        if frame.message_id in COMMAND_IDS:
            self.acknowledge(client, frame, dialect.MAV_RESULT_UNSUPPORTED, self._own_address)

    def _note_unless_repeated(self, client: Client | None, text: str) -> bool:
        """Note that `text` is sent now; return False if it must not be sent.

        A text must not be sent if the same text or too many texts were sent to `client` within 5 s.
        """
        now = self._loop.time()
        self._text_sent_times = {
            key: sent_time
            for key, sent_time in self._text_sent_times.items()
            if now - sent_time < _TEXT_REPEAT_PERIOD
        }
        count = sum(receiver is client for receiver, _ in self._text_sent_times)
        if (client, text) in self._text_sent_times or (
            client is not None and count >= _MAX_ANSWERS
        ):
            return False
        self._text_sent_times[client, text] = now
        return True

    def _text_messages(self, text: str, severity: int) -> list[Message]:
        self._text_id = self._text_id % MAX_TEXT_ID + 1
        return status_texts(ascii_for(text)[:_MAX_TEXT_LENGTH], severity, self._text_id)

    def _frame(self, message: Message, sender: Address | None = None) -> bytes:
        signing = self._settings.signing
        system, component = sender or self._own_address
        frame = build_frame(
            message.get_msgId(),
            encode(message),
            sequence=self._sequence,
            system=system,
            component=component,
            signed=signing is not None,
        )
        self._sequence = (self._sequence + 1) & 0xFF
        return frame if signing is None else signing.sign(frame)


def _heartbeat() -> Message:
    return dialect.MAVLink_heartbeat_message(
        MAV_TYPE_ONBOARD_CONTROLLER, _AUTOPILOT_INVALID, 0, 0, _STATE_ACTIVE, _MAVLINK_VERSION
    )


def _acknowledgement(frame: Frame, result: int) -> Message | None:
    """COMMAND_ACK for a command, MISSION_ACK for a mission item; None for other messages."""
    sender = {"target_system": frame.system, "target_component": frame.component}
    if frame.message_id in MISSION_ITEMS:
        return dialect.MAVLink_mission_ack_message(**sender, type=dialect.MAV_MISSION_DENIED)
    if frame.message_id == dialect.MAVLINK_MSG_ID_SET_MODE:
        command = dialect.MAV_CMD_DO_SET_MODE
    else:
        message = command_in(frame)
        if message is None:
            return None
        command = message.command
    return dialect.MAVLink_command_ack_message(command, result, **sender)
