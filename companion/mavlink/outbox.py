"""Sends frames: numbers and signs them, and sends them at once or not at all."""

import asyncio
from math import inf

from companion.attitude.types import BodyRates
from companion.mavlink.codec import SYSTEM_TIME, SetpointEncoder, encode_system_time
from companion.mavlink.framing import build_frame
from companion.mavlink.messages import Message, dialect, encode
from companion.mavlink.settings import MAV_TYPE_ONBOARD_CONTROLLER, LinkSettings
from companion.mavlink.stats import LinkStats
from companion.mavlink.transport.base import Tap, Transport

_MAVLINK_VERSION = 3
"""Field `mavlink_version` of HEARTBEAT in MAVLink 1 and 2."""


class Outbox:
    """Numbers, signs and sends frames. A frame that cannot be sent now is dropped.

    Attributes:
        transport: the open connection; None while there is none.
        last_setpoint_at: event-loop time of the last setpoint, sent or dropped, s; −inf before the
            first.
    """

    def __init__(self, settings: LinkSettings, stats: LinkStats, tap: Tap | None) -> None:
        self._settings, self._stats, self._tap = settings, stats, tap
        self._signing = settings.signing
        self._loop = asyncio.get_running_loop()
        self._sequence = 0
        self._setpoint_encoder = SetpointEncoder(
            settings.source_system,
            settings.source_component,
            settings.target_system,
            settings.target_component,
            signed=settings.signing is not None,
        )
        self._latched_setpoint: tuple[int, BodyRates, float] | None = None
        self.transport: Transport | None = None
        self.last_setpoint_at = -inf

    def send_setpoint(self, time_boot_ms: int, rates: BodyRates, thrust: float) -> bool:
        """Send SET_ATTITUDE_TARGET now; return False if it could not be sent.

        Raises:
            InvalidSetpoint: a value must not reach the vehicle; see `SetpointEncoder.frame`.
        """
        was_sent = self._send_frame(
            self._setpoint_encoder.frame(self._sequence, time_boot_ms, rates, thrust)
        )
        self.last_setpoint_at = self._loop.time()
        return was_sent

    def latch(self, time_boot_ms: int, rates: BodyRates, thrust: float) -> bool:
        """Keep a setpoint for `close_step`; a later setpoint in the same step replaces it.

        Returns:
            Whether there is a connection to send it on.

        Raises:
            InvalidSetpoint: see `send_setpoint`; nothing was kept.
        """
        self._setpoint_encoder.frame(0, time_boot_ms, rates, thrust)
        self._latched_setpoint = (time_boot_ms, rates, thrust)
        return self.transport is not None

    def close_step(self, time_boot_ms: int) -> None:
        """Close a lockstep step: send the setpoint kept by `latch`, or else a SYSTEM_TIME.

        The SYSTEM_TIME is not recorded.
        """
        latched, self._latched_setpoint = self._latched_setpoint, None
        if latched is not None:
            self.send_setpoint(*latched)
        else:
            self._send_frame(
                self._frame(SYSTEM_TIME, encode_system_time(time_boot_ms)), record=False
            )

    def send_heartbeat(self) -> None:
        """Send one HEARTBEAT, as an onboard controller in the state active."""
        self.send(
            dialect.MAVLink_heartbeat_message(
                type=MAV_TYPE_ONBOARD_CONTROLLER,
                autopilot=dialect.MAV_AUTOPILOT_INVALID,
                base_mode=0,
                custom_mode=0,
                system_status=dialect.MAV_STATE_ACTIVE,
                mavlink_version=_MAVLINK_VERSION,
            )
        )

    def send(self, message: Message) -> bool:
        """Send a pymavlink message; return False if it could not be sent."""
        return self.send_payload(message.get_msgId(), encode(message))

    def send_payload(self, message_id: int, payload: bytes) -> bool:
        """Send a message given by its payload; return False if it could not be sent."""
        return self._send_frame(self._frame(message_id, payload))

    def forward(self, frame: bytes) -> bool:
        """Send a whole frame of another node unchanged; return False if it could not be sent."""
        if self.transport is None or not self.transport.send(frame):
            return False
        self._stats.forwarded += 1
        if self._tap is not None:
            self._tap(self._loop.time(), frame)
        return True

    def _frame(self, message_id: int, payload: bytes) -> bytes:
        return build_frame(
            message_id,
            payload,
            sequence=self._sequence,
            system=self._settings.source_system,
            component=self._settings.source_component,
            signed=self._signing is not None,
        )

    def _send_frame(self, frame: bytes, *, record: bool = True) -> bool:
        if self._signing is not None:
            frame = self._signing.sign(frame)
        if record:  # not for frames that close a step: their number depends on wall time
            self._sequence = (self._sequence + 1) & 0xFF
        if self.transport is None or not self.transport.send(frame):
            self._stats.not_sent += 1
            return False
        self._stats.sent += 1
        if self._tap is not None and record:
            self._tap(self._loop.time(), frame)
        return True
