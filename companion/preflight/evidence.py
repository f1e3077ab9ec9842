"""What was received from a vehicle and its link: the input of the checks."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import NamedTuple

from companion.config.known_drag import KnownDrag
from companion.guidance import ManeuverSequence
from companion.mavlink.stats import share_lost
from companion.preflight.parameter_survey import Survey
from companion.vehicle.autopilot import Autopilot
from companion.vehicle.state import VehicleState
from companion.vehicle.streams import StreamRate

_POSITION_MESSAGES = frozenset(
    {"LOCAL_POSITION_NED", "GLOBAL_POSITION_INT", "HOME_POSITION", "ODOMETRY"}
)
"""Messages that autopilots send only when their estimator has a position."""


class Stage(Enum):
    """State in which a vehicle is checked; the value completes "the vehicle is ready …"."""

    GROUND = "to be armed"
    """The vehicle stands on the ground, disarmed."""
    ARMED = "to take off"
    """The vehicle stands on the ground, armed."""
    AIRBORNE = "to be taken over"
    """The vehicle hovers, flown by its autopilot."""


class Identity(NamedTuple):
    """AUTOPILOT_VERSION; all `None` if it was not received."""

    version: str | None = None
    """Version of the flight software, such as 4.7.0-dev."""
    capabilities: int | None = None
    """Bits of MAV_PROTOCOL_CAPABILITY."""
    uid: str | None = None
    """Hardware id in hexadecimal digits; `None` if the hardware has none."""


class LinkQuality(NamedTuple):
    """Quality of the link while we listened."""

    frame_count: int
    """Number of accepted frames."""
    lost_count: int
    """Number of frames missing in the vehicle's sequence numbers."""
    damaged_count: int
    """Number of frames with a wrong checksum."""
    not_finite_count: int
    """Messages refused for a NaN or infinity."""
    reconnect_count: int
    """Number of times that the connection was opened again."""
    round_trip: float | None
    """Shortest recent TIMESYNC round trip, s; `None` if none was answered."""
    jitter: float | None
    """Largest minus smallest recent round trip, s; `None` if none was answered."""
    notices: tuple[str, ...] = ()
    """Messages of the link about signatures and the peer."""
    timesync_on_other_clock: bool = False
    """Whether TIMESYNC uses another clock than the samples' stamps."""
    repeated_count: int = 0
    """Number of frames whose sequence number went back."""

    @property
    def loss(self) -> float:
        """Share of the vehicle's messages that were lost."""
        return share_lost(self.frame_count, self.lost_count)


class SampleTimes(NamedTuple):
    """Times of the attitude samples received, by the vehicle's clock and by our clock."""

    sample_count: int = 0
    longest_pause: float = 0.0
    """Longest time between two samples by our clock, s."""
    not_newer_count: int = 0
    """Number of samples stamped no later than the one before."""
    clock_rate: float | None = None
    """Seconds of the vehicle's clock per second of our clock; `None`: too few samples."""
    age: float | None = None
    """Median age of the samples at arrival, s; `None`: TIMESYNC does not measure it."""
    clock_change: str = ""
    """Description of a jump or restart of the vehicle's clock; empty: none."""
    unusable_count: int = 0
    """Number of samples that are not a unit quaternion or not finite."""
    rate: float | None = None
    """Effective sample rate, Hz: pauses between bursts lower the rate (`IntervalSums`). `None`: too
    few samples."""


@dataclass(slots=True)
class OtherNodes:
    """Other nodes on the link."""

    sources: set[tuple[int, int]] = field(default_factory=set)
    """(system, component) of every node that was heard."""
    companions: set[tuple[int, int]] = field(default_factory=set)
    """Nodes whose heartbeat has the type onboard controller."""
    autopilots: set[tuple[int, int]] = field(default_factory=set)
    """Nodes whose heartbeat shows an autopilot that this program supports."""
    setpoint_senders: set[tuple[int, int]] = field(default_factory=set)
    has_foreign_attitude_target: bool = False
    """Whether ATTITUDE_TARGET shows rates or thrust while the vehicle is disarmed, so that another
    node must have sent setpoints."""


@dataclass(frozen=True, slots=True)
class Evidence:
    """What was received and measured in one session with the vehicle, for the checks to judge."""

    autopilot: Autopilot
    state: VehicleState
    """The vehicle's newest telemetry."""
    survey: Survey
    """The parameters that matter to a flight."""
    streams: Mapping[str, StreamRate]
    """Rates requested, granted and counted, by message."""
    received_counts: Mapping[str, int]
    """Number of messages since the link was opened, for each message of `streams`."""
    counting_time: float
    """Time over which messages were counted, s."""
    link: LinkQuality
    samples: SampleTimes
    other_nodes: OtherNodes
    reset_count: int
    """Number of estimator resets while we listened."""
    identity: Identity
    """The autopilot's version and hardware."""
    stage: Stage = Stage.GROUND
    """State in which the vehicle is checked."""
    warnings: tuple[str, ...] = ()
    """The autopilot's texts of severity warning or worse."""
    maneuvers: ManeuverSequence | None = None
    """The planned maneuvers; `None`: no maneuvers."""
    known_drag: KnownDrag = field(default_factory=KnownDrag)
    """What is known of this vehicle's drag."""

    @property
    def awaits_position(self) -> bool:
        """Whether the vehicle has no position yet, or its estimator is not ready."""
        readiness = self.state.readiness
        estimator_only = readiness._replace(has_position=True, has_home=True, prearm_passed=True)
        return (
            not readiness.has_position or self.autopilot.why_not_ready(estimator_only) is not None
        )

    @property
    def is_booting(self) -> bool:
        """Whether no recent estimator status is known; ArduPilot sends little while it boots."""
        return self.state.readiness.estimator_flags is None

    @property
    def awaited_messages(self) -> tuple[str, ...]:
        """Messages that the vehicle will send only when it has booted or has a position."""
        if not self.awaits_position:
            return ()
        return tuple(
            name
            for name, rate in self.streams.items()
            if rate.achieved == 0.0
            and not rate.refusal
            and (self.is_booting or name in _POSITION_MESSAGES)
        )
