"""Settings of a link."""

from dataclasses import dataclass

from companion.mavlink.signing import Signing

MAV_COMP_ID_ONBOARD_COMPUTER = 191
MAV_TYPE_ONBOARD_CONTROLLER = 18
MAV_TYPE_GCS = 6


@dataclass(frozen=True)
class LinkSettings:
    """Where the vehicle is and who we are.

    Attributes:
        endpoint: See `companion.mavlink.transport.endpoint`.
        target_system: The only system listened to and commanded.
        target_component: Its component; 1 is the autopilot.
        source_system: Our system id; companions share the vehicle's.
        source_component: Our component id.
        heartbeat_type: MAV_TYPE of our heartbeat. PX4 sends its STATUSTEXTs only on links where
            it hears type GCS (6).
        heartbeat_rate_hz: Rate of our heartbeat. No setpoint depends on it.
        signing: Signs what we send and refuses what is not signed; `None`: neither.
        lockstep: Vehicle time drives the event loop; needs `companion.mavlink.lockstep.run`.
        first_beacon_timeout_s: Lockstep: wall time to wait for the vehicle when opening.
    """

    endpoint: str
    target_system: int = 1
    target_component: int = 1
    source_system: int = 1
    source_component: int = MAV_COMP_ID_ONBOARD_COMPUTER
    heartbeat_type: int = MAV_TYPE_ONBOARD_CONTROLLER
    heartbeat_rate_hz: float = 1.0
    signing: Signing | None = None
    lockstep: bool = False
    first_beacon_timeout_s: float = 10.0
