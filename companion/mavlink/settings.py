"""Settings of a link."""

from dataclasses import dataclass

from companion.mavlink.signing import Signing

MAV_COMP_ID_ONBOARD_COMPUTER = 191
MAV_TYPE_ONBOARD_CONTROLLER = 18


@dataclass(frozen=True)
class LinkSettings:
    """The endpoint, and the ids of the vehicle and of this program."""

    endpoint: str
    """Endpoint such as `udpin://0.0.0.0:14540` or `serial:///dev/ttyAMA0:921600`."""
    target_system: int = 1
    """System id of the vehicle; frames of other systems are ignored."""
    target_component: int = 1
    """Component id of the vehicle; 1 is the autopilot."""
    source_system: int = 1
    """System id of this program; a companion computer uses the system id of its vehicle."""
    source_component: int = MAV_COMP_ID_ONBOARD_COMPUTER
    """Component id of this program."""
    heartbeat_rate_hz: float = 1.0
    """Rate of the heartbeats that this program sends, Hz; independent of the setpoints."""
    signing: Signing | None = None
    """Signs frames that are sent and checks received frames; `None`: no signing."""
    lockstep: bool = False
    """Whether vehicle time drives the event loop; needs `companion.mavlink.lockstep.run`."""
    first_beacon_timeout_s: float = 10.0
    """Wall time to wait for the first beacon in lockstep, s."""
