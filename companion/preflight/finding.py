"""Findings of the preflight checks: fact, consequence, remedy, and source.

The key of a finding about a parameter is the parameter's name. The key of a finding about a message
rate is `link.streams.MESSAGE`; below a required minimum it is `link.min_attitude_rate_hz` or
`link.min_position_rate_hz`. All other keys are in `Key`.
"""

from dataclasses import dataclass, replace
from enum import StrEnum
from typing import NamedTuple

from companion.vehicle.parameter_rules import CheckResult

SAFE, UNSAFE = CheckResult.SAFE, CheckResult.UNSAFE
INEFFECTIVE, NOT_READY = CheckResult.INEFFECTIVE, CheckResult.NOT_READY


class Key(StrEnum):
    """Names of the findings that are not about one parameter, as `flight.accept` uses them."""

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
    AUTOPILOT_TEXTS = "vehicle.words"
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
    SECOND_VEHICLE = "link.second_vehicle"
    OTHER_SETPOINTS = "link.other_setpoints"
    OFFBOARD_LOSS = "safety.offboard_loss"
    FENCE = "safety.fence_polygon_deg"
    MANEUVERS = "flight.maneuvers"
    TAKEOFF_TIME = "flight.takeoff_timeout_s"
    LANDING_TIME = "flight.landing_timeout_s"
    PLANNER = "planner.name"
    DEAD_TIME = "vehicle.dead_time_ms"
    TILT_COMPENSATION = "thrust.autopilot_compensates_tilt"
    ACCEPT = "flight.accept"
    IDENTIFIED = "vehicle.identified"
    IDENTIFIED_ON = "vehicle.autopilot"
    UNITS = "configuration.units"
    RESPONSE = "planner.gain_per_s"
    BODY_RATE_KEY = "safety.max_body_rate_deg_s"


class ParameterChange(NamedTuple):
    """A parameter to set."""

    parameter: str
    """Name of the parameter in this autopilot."""
    old: float
    """Present value."""
    new: float
    """Proposed value."""
    reboot: bool
    """Whether the change takes effect only after the autopilot restarts."""


@dataclass(frozen=True, slots=True)
class Finding:
    """Result of one check."""

    key: str
    """A `Key`, the newest name of a parameter, or the key of a message rate."""
    result: CheckResult
    fact: str
    """The fact, as a clause."""
    consequence: str = ""
    """The consequence, or the effect of the parameter; may be empty."""
    fix: str = ""
    """What the user should do; empty if there is nothing to do."""
    source: str = ""
    """Source of the fact: a MAVLink message, a reference, a measurement."""
    change: ParameterChange | None = None
    """The parameter change that would fix the problem; `None`: no such change."""

    def safe_unless(self, problem: bool) -> "Finding":
        """This finding if there is a problem; else a safe finding with the same fact and source."""
        return self if problem else replace(self, result=SAFE, consequence="", fix="")

    def sentence(self) -> str:
        """The finding without its source, for the user."""
        consequence = f": {self.consequence}" if self.consequence else ""
        fix = f"; {self.fix}" if self.fix else ""
        return f"{self.fact}{consequence}{fix}"
