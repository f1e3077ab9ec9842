"""The same link to the same vehicle, by way of MAVSDK.

Setpoints do not go by MAVSDK's offboard plugin. That repeats the last one 20 times a second, from a
thread of its own, until it is told to stop. Whatever is to tell it can come too late: a process
that was stopped in flight and goes on sent old body rates once more before any thread of ours ran,
and PX4, whose failsafe was landing by then, took that for a wish to be in offboard and obeyed. So
setpoints go as all other frames do: ours, each sent once, in answer to a fresh sample. What repeats
nothing needs nobody who ends it.
"""

import logging

from companion.mavlink.errors import LinkError
from companion.mavlink.frame_filter import Notice
from companion.mavlink.settings import LinkSettings
from companion.mavlink.transport.base import Lost, Receiver, Tap, Transport
from companion.mavlink.transport.endpoint import Endpoint, UdpIn
from companion.mavsdk_link.transport import MavsdkTransport
from companion.vehicle.link import Link

_LOG = logging.getLogger(__name__)


class MavsdkLink(Link):
    """A link whose connection is MAVSDK's.

    All that is said and heard is as in `Link`, for MAVSDK forwards it; so samples carry the
    vehicle's time, which MAVSDK's own telemetry does not give. What the vehicle answers to MAVSDK's
    own questions does not come here, and counts as lost in `stats`.

    Args:
        settings: As of `Link`.
        tap: As of `Link`.
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

        async def opener(where: Endpoint, receiver: Receiver, _lost: Lost) -> Transport:
            speaks_first = not isinstance(where, UdpIn)
            return MavsdkTransport(settings, receiver.receive, speaks_first=speaks_first)

        super().__init__(settings, tap, opener, notice)
