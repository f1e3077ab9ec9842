"""A link to the vehicle whose connection MAVSDK holds.

Setpoints are not sent by MAVSDK's offboard plugin. The plugin repeats the last setpoint 20 times a
second, in its own thread, until it is told to stop, which can be too late. Measured: a process was
stopped in flight and resumed, and the plugin sent old body rates before any other thread ran. PX4
was landing by its failsafe; it took them as a request for offboard mode, and obeyed them. So each
setpoint is one frame of this program, sent once, in answer to a fresh sample.
"""

import logging

from companion.mavlink.errors import LinkError
from companion.mavlink.frame_filter import Notice
from companion.mavlink.settings import LinkSettings
from companion.mavlink.transport.base import LostCallback, Receiver, Tap, Transport
from companion.mavlink.transport.endpoint import Endpoint
from companion.mavsdk_link.transport import MavsdkTransport
from companion.vehicle.link import Link

_LOG = logging.getLogger(__name__)


class MavsdkLink(Link):
    """A `Link` whose connection MAVSDK holds.

    MAVSDK forwards all frames unchanged, so samples carry the vehicle's time stamps, which MAVSDK's
    own telemetry does not give. The vehicle's answers to MAVSDK's own requests do not arrive here,
    and count as lost in `stats`.

    Args:
        settings: the endpoint, and the ids of the vehicle and of this program.
        tap: called with every frame accepted from and sent to the vehicle.
        notice: called once with each notice about the peer; by default it logs a warning.

    Raises:
        EndpointError: the endpoint cannot be parsed.
        LinkError: the settings demand lockstep or signing, which MAVSDK cannot do.
    """

    def __init__(
        self, settings: LinkSettings, tap: Tap | None = None, notice: Notice = _LOG.warning
    ) -> None:
        if settings.lockstep or settings.signing is not None:
            raise LinkError("MAVSDK can neither fly in lockstep nor sign; use link.backend: direct")

        async def opener(_endpoint: Endpoint, receiver: Receiver, _lost: LostCallback) -> Transport:
            return MavsdkTransport(settings, receiver.receive)

        super().__init__(settings, tap, opener, notice)
