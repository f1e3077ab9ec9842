"""What was heard of a vehicle and its link, for the checks to judge."""

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
"""Autopilots send none of these before their estimator has a position."""


class Stage(Enum):
    """What the vehicle is about to do; the value is said of it."""

    GROUND = "to be armed"
    """It stands disarmed."""
    ARMED = "to take off"
    """It stands armed."""
    AIRBORNE = "to be taken over"
    """It holds in the air, flown by its autopilot."""


class Identity(NamedTuple):
    """AUTOPILOT_VERSION; `None` where it was not told.

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
        round_trip: Shortest of late by TIMESYNC, s; `None` if it was never answered.
        jitter: By how much the round trips differed, s.
        other_clock: Whether TIMESYNC counts another clock than the samples' stamps.
        notices: What keeps the two sides from understanding each other.
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
        """Share of the vehicle's messages that did not come."""
        return share_lost(self.frames, self.lost)


class SampleTimes(NamedTuple):
    """The attitude samples that came, by both clocks.

    Attributes:
        heard: How many.
        longest_pause: Between two of them by our clock, s.
        not_newer: Stamped no later than the one before.
        clock_rate: Vehicle seconds per second of ours; `None` for too few samples.
        age: Median of their ages at arrival, s; `None` where it is not known (`VehicleClock`).
        clock_change: How the vehicle's clock jumped or restarted meanwhile, in words, or empty.
        unusable: No unit quaternion, or with a number that is not finite.
        rate: Hz, bursts counted as what they are (`HeldRates`); `None` for too few samples.
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
    """Others on the link.

    Attributes:
        sources: (system, component) of all that were heard.
        companions: Of them those whose heartbeat says onboard controller.
        steering: Of them those who sent setpoints.
        echo: Whether the autopilot tells of rates or thrust though nobody may fly it.
    """

    sources: frozenset[tuple[int, int]] = frozenset()
    companions: frozenset[tuple[int, int]] = frozenset()
    steering: frozenset[tuple[int, int]] = frozenset()
    echo: bool = False


@dataclass(frozen=True, slots=True)
class Evidence:
    """All that was gathered.

    Attributes:
        family: The autopilot's.
        state: What the vehicle told, the newest of each.
        survey: The parameters that matter.
        streams: What was asked, granted and counted, by message.
        received: How often each of these came since the link was opened.
        window: How long was counted, s.
        link: How good the link is.
        samples: The attitude samples' times.
        other_nodes: Who else is there.
        resets: How often the estimator jumped meanwhile.
        identity: What the autopilot is.
        stage: What the vehicle is judged for.
        words: What the autopilot said meanwhile that is a warning or worse.
        maneuvers: What is to be flown; `None` where nothing is.
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
        """Whether the vehicle has no position yet, so that nothing about it can be told."""
        readiness = self.state.readiness
        estimator_only = readiness._replace(position=True, home=True, prearm_good=True)
        return not readiness.position or self.autopilot.not_ready(estimator_only) is not None

    @property
    def booting(self) -> bool:
        """Whether nothing was told of the estimator yet: ArduPilot sends nothing else then."""
        return self.state.readiness.estimator_flags is None

    @property
    def awaited(self) -> tuple[str, ...]:
        """Messages that do not come as long as the vehicle is not ready to send them."""
        if not self.awaits_position:
            return ()
        return tuple(
            name
            for name, rate in self.streams.items()
            if rate.achieved == 0.0
            and not rate.refusal
            and (self.booting or name in _ABOUT_POSITION)
        )
