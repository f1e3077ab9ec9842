"""What the doctor says: findings, each with what it means, what to do, and where it is known from.

Findings about a parameter have its name as their key; all other keys stand here.
"""

from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple

from companion.vehicle.parameter_rules import Verdict


class Key(StrEnum):
    """What findings that are not about one parameter are called, in `flight.accept`, say."""

    HEARTBEAT = "vehicle.heartbeat"
    ANSWERS = "vehicle.answers"
    SUPPORTED = "vehicle.supported"
    ARMED = "vehicle.armed"
    FAILSAFE = "vehicle.failsafe"
    READY = "vehicle.ready"
    GPS = "vehicle.gps"
    LANDED = "vehicle.landed"
    HOME = "vehicle.home"
    BATTERY = "vehicle.battery"
    VERSION = "vehicle.version"
    WORDS = "vehicle.words"
    ESTIMATOR_RESETS = "vehicle.estimator_resets"
    PARAMETERS = "vehicle.parameters"
    STREAMS = "link.streams"
    LOSS = "link.loss"
    DAMAGE = "link.damage"
    NOT_FINITE = "link.not_finite"
    RECONNECTS = "link.reconnects"
    ROUND_TRIP = "link.round_trip"
    JITTER = "link.jitter"
    AGE = "link.age"
    PAUSES = "link.pauses"
    SIGNING = "link.signing"
    ENDPOINT = "link.endpoint"
    CLOCK = "link.clock"
    ATTITUDE = "vehicle.attitude"
    OUR_IDS = "link.our_ids"
    SECOND_COMPANION = "link.second_companion"
    OTHER_SETPOINTS = "link.other_setpoints"
    OFFBOARD_LOSS = "safety.offboard_loss"
    FENCE = "safety.fence_polygon_deg"
    MANEUVERS = "flight.maneuvers"
    PLANNER = "planner.name"
    DEAD_TIME = "vehicle.dead_time_ms"
    ACCEPT = "flight.accept"


class Change(NamedTuple):
    """A parameter that is to be set.

    Attributes:
        parameter: Its name, as this autopilot knows it.
        old: Value that it has.
        new: Value that it should have.
        reboot: Whether it counts only after the autopilot was started anew.
    """

    parameter: str
    old: float
    new: float
    reboot: bool


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing that was looked at.

    Attributes:
        key: A `Key`, or a parameter's (newest) name.
        verdict: How much it matters.
        found: What is so, one clause.
        because: What comes of it, or, where nothing does, what it decides; may be empty.
        mend: What to do about it; empty where nothing can or needs to be done.
        source: Where this is known from: a MAVLink message, a reference, a measurement.
        change: The parameter to set, if that mends it.
    """

    key: str
    verdict: Verdict
    found: str
    because: str = ""
    mend: str = ""
    source: str = ""
    change: Change | None = None

    def sentence(self) -> str:
        """All of it but the source, for people."""
        because = f": {self.because}" if self.because else ""
        mend = f"; {self.mend}" if self.mend else ""
        return f"{self.found}{because}{mend}"
