"""What was received from a vehicle and its link: the input of the checks."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

from companion.guidance import ManeuverSequence
from companion.mavlink.stats import share_lost
from companion.preflight.parameter_survey import Survey
from companion.vehicle.autopilot import Autopilot
from companion.vehicle.state import VehicleState
from companion.vehicle.streams import StreamRate

_ABOUT_POSITION = frozenset(
    {"LOCAL_POSITION_NED", "GLOBAL_POSITION_INT", "HOME_POSITION", "ODOMETRY"}
)
"""Autopilots send these only once their estimator has a position."""


class Stage(Enum):
    """What the vehicle is about to do; the value completes "ready …"."""

    GROUND = "to be armed"
    """The vehicle stands on the ground, disarmed."""
    ARMED = "to take off"
    """The vehicle stands on the ground, armed."""
    AIRBORNE = "to be taken over"
    """The vehicle hovers, flown by its autopilot."""


class Identity(NamedTuple):
    """AUTOPILOT_VERSION; `None` where it was not received.

    Attributes:
        version: Of the flight software, as in 4.7.0-dev.
        capabilities: MAV_PROTOCOL_CAPABILITY.
        uid: Of the hardware.
    """

    version: str | None = None
    capabilities: int | None = None
    uid: str | None = None


class LinkQuality(NamedTuple):
    """The link while we listened.

    Attributes:
        frames: Accepted.
        lost: Missing in the vehicle's running numbers.
        damaged: With a wrong checksum.
        not_finite: Messages refused for a NaN or infinity.
        reconnects: How often the connection was opened again.
        round_trip: Shortest recent TIMESYNC round trip, s; `None` if none was answered.
        jitter: By how much the round trips differed, s.
        other_clock: Whether TIMESYNC uses another clock than the samples' stamps.
        notices: Reasons why the two sides do not understand each other.
    """

    frames: int
    lost: int
    damaged: int
    not_finite: int
    reconnects: int
    round_trip: float | None
    jitter: float | None
    notices: tuple[str, ...] = ()
    other_clock: bool = False

    @property
    def loss(self) -> float:
        """Share of the vehicle's messages that were lost."""
        return share_lost(self.frames, self.lost)


class SampleTimes(NamedTuple):
    """The attitude samples received, by both clocks.

    Attributes:
        heard: Number of samples.
        longest_pause: Between two of them by our clock, s.
        not_newer: Stamped no later than the one before.
        clock_rate: Vehicle seconds per second of ours; `None` for too few samples.
        age: Median of their ages at arrival, s; `None` where it is not known (`VehicleClock`).
        clock_change: How the vehicle's clock jumped or restarted meanwhile; empty: not at all.
        unusable: Samples that are no unit quaternion, or hold a number that is not finite.
        rate: Hz, lowered for bursts (`HeldRates`); `None` for too few samples.
    """

    heard: int = 0
    longest_pause: float = 0.0
    not_newer: int = 0
    clock_rate: float | None = None
    age: float | None = None
    clock_change: str = ""
    unusable: int = 0
    rate: float | None = None


class OtherNodes(NamedTuple):
    """Other nodes on the link.

    Attributes:
        sources: (system, component) of every node that was heard.
        companions: Those whose heartbeat has the type onboard controller.
        steering: Those that sent setpoints.
        echo: Whether ATTITUDE_TARGET shows rates or thrust although the vehicle is disarmed.
    """

    sources: frozenset[tuple[int, int]] = frozenset()
    companions: frozenset[tuple[int, int]] = frozenset()
    steering: frozenset[tuple[int, int]] = frozenset()
    echo: bool = False


@dataclass(frozen=True, slots=True)
class Evidence:
    """All evidence of one session.

    Attributes:
        autopilot: Which autopilot it is.
        state: The vehicle's newest telemetry.
        survey: The parameters that matter.
        streams: Rates requested, granted and counted, by message.
        received: Number of each of these messages since the link was opened.
        window: Time over which was counted, s.
        link: How good the link is.
        samples: The attitude samples' times.
        other_nodes: Other nodes on the link.
        resets: Number of estimator resets meanwhile.
        identity: The autopilot's version and hardware.
        stage: What the vehicle is about to do.
        words: The autopilot's texts meanwhile with severity warning or worse.
        maneuvers: The planned maneuvers; `None`: none are planned.
    """

    autopilot: Autopilot
    state: VehicleState
    survey: Survey
    streams: Mapping[str, StreamRate]
    received: Mapping[str, int]
    window: float
    link: LinkQuality
    samples: SampleTimes
    other_nodes: OtherNodes
    resets: int
    identity: Identity
    stage: Stage = Stage.GROUND
    words: tuple[str, ...] = ()
    maneuvers: ManeuverSequence | None = None

    @property
    def awaits_position(self) -> bool:
        """Whether the vehicle has no position yet."""
        readiness = self.state.readiness
        estimator_only = readiness._replace(position=True, home=True, prearm_good=True)
        return not readiness.position or self.autopilot.not_ready(estimator_only) is not None

    @property
    def booting(self) -> bool:
        """Whether no estimator status came yet: until then ArduPilot sends no other telemetry."""
        return self.state.readiness.estimator_flags is None

    @property
    def awaited(self) -> tuple[str, ...]:
        """Messages that the vehicle is not ready to send yet."""
        if not self.awaits_position:
            return ()
        return tuple(
            name
            for name, rate in self.streams.items()
            if rate.achieved == 0.0
            and not rate.refusal
            and (self.booting or name in _ABOUT_POSITION)
        )
