"""The same link to the same vehicle, by way of MAVSDK."""

import asyncio
import logging
from math import degrees

from companion.attitude import BodyRates
from companion.mavlink.codec import SET_ATTITUDE_TARGET, SetpointEncoder
from companion.mavlink.errors import LinkError, LinkTimeout
from companion.mavlink.inbox import Notice
from companion.mavlink.link import Link
from companion.mavlink.records import Heartbeat
from companion.mavlink.settings import LinkSettings
from companion.mavlink.transport import Receive, Tap, Transport
from companion.mavsdk_link.offboard import OffboardSetpoints
from companion.mavsdk_link.transport import MavsdkTransport

_LOG = logging.getLogger(__name__)

_MESSAGE_ID = 7  # of a MAVLink 2 frame; the two higher bytes are 0 for all that counts here
_POLL_S = 0.02


class MavsdkLink(Link):
    """A link whose connection and whose setpoints are MAVSDK's.

    All that is said and heard otherwise (state, commands, parameters, rates, TIMESYNC) is as in
    `Link`, for MAVSDK forwards it; so samples carry the vehicle's time, which MAVSDK's own
    telemetry does not give. What is different: MAVSDK repeats a setpoint until it is stopped, so
    `send_setpoint` has a deadman (`companion.mavsdk_link.deadman`), and MAVSDK stamps setpoints
    with a clock of its own. What the vehicle answers to MAVSDK's own questions does not come here,
    and counts as lost in `stats`.

    Args:
        settings: As of `Link`.
        tap: As of `Link`; it sees the setpoints that MAVSDK really sent, repeated ones included.
        notice: As of `Link`.

    Raises:
        EndpointError: The endpoint's notation is wrong.
        LinkError: Lockstep or signing is asked for, which MAVSDK cannot do.
    """

    def __init__(
        self, settings: LinkSettings, tap: Tap | None = None, notice: Notice = _LOG.warning
    ) -> None:
        if settings.lockstep or settings.signing is not None:
            raise LinkError("MAVSDK can neither fly in lockstep nor sign; use link.backend: direct")
        super().__init__(settings, tap, self._open, notice)
        self._sent_tap = tap
        self._transport: MavsdkTransport | None = None
        self._setpoints: OffboardSetpoints | None = None
        self._checks = SetpointEncoder(0, 0, 0, 0, signed=False)

    async def __aexit__(self, *arguments: object) -> None:
        if self._setpoints is not None:
            self._setpoints.close()
            self._setpoints = None
        await super().__aexit__(*arguments)

    async def wait_connected(self, timeout_s: float) -> Heartbeat:
        """As of `Link`, and until MAVSDK knows the vehicle, too.

        Raises:
            LinkTimeout: No heartbeat came, or MAVSDK did not take it for an autopilot's.
            UnsupportedAutopilot: It is none that we can fly.
        """
        heartbeat = await super().wait_connected(timeout_s)
        try:
            async with asyncio.timeout(timeout_s):
                while not self._vehicle_known():  # noqa: ASYNC110 - MAVSDK sets no events
                    await asyncio.sleep(_POLL_S)
        except TimeoutError:
            raise LinkTimeout(
                f"MAVSDK found no autopilot in system {self.settings.target_system}"
            ) from None
        return heartbeat

    def send_setpoint(self, time_boot_ms: int, rates: BodyRates, thrust: float) -> bool:
        """As of `Link`, by MAVSDK's offboard plugin; the stamp is checked and not sent."""
        in_degrees = BodyRates(*map(degrees, rates))
        self._checks.frame(0, time_boot_ms, in_degrees, thrust)  # raises what cannot be sent
        if self._setpoints is None:
            return False
        return self._setpoints.send(in_degrees, thrust)

    def quiet(self) -> None:
        """Have MAVSDK repeat no setpoint any more."""
        if self._setpoints is not None:
            self._setpoints.end()

    def _vehicle_known(self) -> bool:
        if self._setpoints is None and self._transport is not None:
            system = self._transport.system(self.settings.target_system)
            if system is not None:
                self._setpoints = OffboardSetpoints(system)
        return self._setpoints is not None

    async def _open(self, _endpoint: object, receive: Receive, _lost: object) -> Transport:
        self._transport = MavsdkTransport(self.settings, receive, self._on_sent)
        return self._transport

    def _on_sent(self, frame: bytes) -> None:
        if frame[_MESSAGE_ID] == SET_ATTITUDE_TARGET:
            self.stats.sent += 1
            if self._sent_tap is not None:
                self._sent_tap(self._loop.time(), frame)
