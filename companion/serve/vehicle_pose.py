"""The vehicle's position and yaw, and the origin of its local frame, for clients' setpoints.

The origin is estimated from pairs of local and global positions.
"""

import asyncio
from contextlib import suppress
from math import cos, degrees, hypot, radians

from companion.attitude import is_unit
from companion.attitude.rotation import euler_angles
from companion.config import Config
from companion.guidance.fence import EARTH_RADIUS, LatLon, local_offset
from companion.guidance.reference import Vector
from companion.mavlink.codec import decode_attitude
from companion.mavlink.errors import LinkError
from companion.mavlink.messages import Message
from companion.preflight.session import wanted_rates
from companion.serve.network.network import Network
from companion.serve.setpoints.request import Origin, Request, VehiclePose, requests_takeoff
from companion.vehicle.link import Link

_CHECK_PERIOD = 1.0
_COUNTING_TIME = 0.1
"""Time for which `Link.set_rates` counts messages after its request, s; short, because the
counts are not used here."""
_MAX_TELEMETRY_AGE = 0.5
"""Largest age of a position or attitude that is used, s."""
_MAX_PAIR_INTERVAL = 0.3
"""Largest time between a local and a global position of a pair, s."""
_NEW_ORIGIN_WEIGHT = 0.05
"""Weight of a new pair of positions; each pair is off by some centimetres. The altitude of home is
exact in each message, and is not averaged."""
_NEW_ORIGIN_DISTANCE = 2.0
"""Distance from the estimate at which a measured origin counts as newly set, m."""


class PoseTracker:
    """Keeps the vehicle's newest position and yaw, and the origin of its local frame."""

    def __init__(self, link: Link, network: Network) -> None:
        self._link, self._network = link, network
        self._origin = OriginEstimate()
        link.subscribe("GLOBAL_POSITION_INT", self._on_global_position)

    def pose(self) -> VehiclePose | None:
        """The present pose; None while position or attitude is unknown or outdated."""
        position, now = self._link.state.position, self._network.now()
        if position is None:
            return None
        age = self._link.clock.age(position.vehicle_time, now) or 0.0
        if (
            max(age, now - position.received, now - self._network.attitude_arrival)
            > _MAX_TELEMETRY_AGE
        ):
            return None
        decoded = decode_attitude(self._network.attitude_payload)
        if decoded is None or not is_unit(decoded[1]):
            return None
        _, _, yaw = euler_angles(decoded[1])
        return VehiclePose(position.position_ned, yaw, self._origin.origin)

    def takeoff_refusal(self, request: Request) -> str | None:
        """Why a request for control on the ground does not begin a take-off; None if it does."""
        pose = self.pose()
        if not self._link.state.landed or pose is None:
            return "take off first: it is not known whether the vehicle stands on the ground"
        if requests_takeoff(request, pose):
            return None
        return "command a height of 1 m or more above the ground, or take off first"

    async def keep_telemetry(self, config: Config) -> None:
        """Until cancelled, request telemetry whenever no attitude comes, as ArduPilot requires."""
        newest_payload = self._network.attitude_payload
        while True:
            await asyncio.sleep(_CHECK_PERIOD)
            payload_before, newest_payload = newest_payload, self._network.attitude_payload
            if newest_payload != payload_before or self._link.state.autopilot is None:
                continue
            with suppress(LinkError):  # the autopilot may be booting; the request is repeated
                await self._link.set_rates(
                    wanted_rates(config, self._link), window_s=_COUNTING_TIME
                )

    def _on_global_position(self, message: Message) -> None:
        position = self._link.state.position
        if position is None or message.lat == message.lon == 0:
            return
        interval = self._link.clock.vehicle_time(message.time_boot_ms) - position.vehicle_time
        if abs(interval) > _MAX_PAIR_INTERVAL:
            return
        north, east, down = (
            coordinate + interval * speed
            for coordinate, speed in zip(position.position_ned, position.velocity_ned, strict=True)
        )
        self._origin.note(
            (north, east, down),
            message.lat * 1e-7,
            message.lon * 1e-7,
            message.alt * 1e-3,
            message.relative_alt * 1e-3,
        )


class OriginEstimate:
    """Averages the origin of the local frame over pairs of simultaneous positions.

    Attributes:
        origin: the estimate, or None before the first pair.
    """

    def __init__(self) -> None:
        self.origin: Origin | None = None

    def note(
        self,
        position_ned: Vector,
        latitude: float,
        longitude: float,
        altitude: float,
        height: float,
    ) -> None:
        """Take a pair of simultaneous positions of the vehicle: local (NED, m), and global.

        Latitude and longitude are in degrees, the altitude above mean sea level and the height
        above home in m.
        """
        north, east, down = position_ned
        measured = Origin(
            latitude - degrees(north / EARTH_RADIUS),
            longitude - degrees(east / (EARTH_RADIUS * cos(radians(latitude)))),
            altitude + down,
            altitude - height,
        )
        estimate = self.origin
        if estimate is None or _distance(estimate, measured) > _NEW_ORIGIN_DISTANCE:
            self.origin = measured
            return
        # The average must not go half round the earth where the longitude changes its sign.
        whole_turns = round((measured.longitude - estimate.longitude) / 360.0)
        measured = measured._replace(longitude=measured.longitude - 360.0 * whole_turns)
        averaged = Origin(
            *(a + _NEW_ORIGIN_WEIGHT * (b - a) for a, b in zip(estimate, measured, strict=True))
        )
        # Arming or a station may set another home; an average would be wrong for seconds.
        self.origin = averaged._replace(home_altitude=measured.home_altitude)


def _distance(a: Origin, b: Origin) -> float:
    offset = local_offset(LatLon(a.latitude, a.longitude), LatLon(b.latitude, b.longitude))
    return hypot(*offset, a.altitude - b.altitude)
