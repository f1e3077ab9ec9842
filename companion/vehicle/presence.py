"""What we say without being asked: that we are here, and what our clock reads."""

import asyncio

from companion.mavlink.messages import dialect
from companion.mavlink.outbox import Outbox
from companion.mavlink.settings import LinkSettings
from companion.vehicle.clock import VehicleClock
from companion.vehicle.timesync import TimeSync

_MAV_AUTOPILOT_INVALID = 8
_MAV_STATE_ACTIVE = 4
_MAVLINK_VERSION = 3
_QUICK_REQUESTS, _QUICK_PERIOD_S = 10, 0.1  # a good clock offset within the first second
_PERIOD_S = 1.0


def send_heartbeat(settings: LinkSettings, outbox: Outbox) -> None:
    """Send one HEARTBEAT: an onboard controller (or what the settings say), active."""
    outbox.message(
        dialect.MAVLink_heartbeat_message(
            type=settings.heartbeat_type,
            autopilot=_MAV_AUTOPILOT_INVALID,
            base_mode=0,
            custom_mode=0,
            system_status=_MAV_STATE_ACTIVE,
            mavlink_version=_MAVLINK_VERSION,
        )
    )


async def send_heartbeats(settings: LinkSettings, outbox: Outbox) -> None:
    """Send heartbeats until cancelled. They keep nothing alive but our presence."""
    while True:
        send_heartbeat(settings, outbox)
        await asyncio.sleep(1.0 / settings.heartbeat_rate_hz)


async def synchronise(timesync: TimeSync, clock: VehicleClock) -> None:
    """Ask for the vehicle's time until cancelled."""
    now = asyncio.get_running_loop().time
    for _ in range(_QUICK_REQUESTS):
        timesync.ask()
        await asyncio.sleep(_QUICK_PERIOD_S)
    while True:
        timesync.ask()
        await asyncio.sleep(_PERIOD_S)
        clock.look(now())
