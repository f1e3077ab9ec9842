"""The typed configuration: all sections, and the rules between them.

The defaults fit the mock vehicle.
"""

from collections.abc import Iterator, Mapping
from math import ceil, cos, degrees, floor, hypot, sin
from typing import Annotated, Any, ClassVar

from pydantic import Field, model_validator

from companion.attitude.planner import FIRST_ORDER, MODEL_FOLLOWING
from companion.config.computer import LinkConfig, RealtimeConfig, RecordingConfig
from companion.config.flight import (
    CircleConfig,
    CornersConfig,
    FlightConfig,
    HoverConfig,
    IdentifyConfig,
    StepsConfig,
)
from companion.config.guidance import AUTO, GuidanceConfig, PlannerConfig
from companion.config.limits import DeadmanConfig, LimitsConfig
from companion.config.safety import SafetyConfig
from companion.config.serve import ServeConfig
from companion.config.vehicle import ThrustConfig, VehicleConfig
from companion.files.yaml_file import Section
from companion.guidance.fence import Fence
from companion.guidance.thrust import TILT_THRUST_SHARE, ThrustCurve, largest_tilt

FileName = Annotated[str, Field(max_length=1000)]
MOST_INCLUDED = 32
"""Largest number of included files, including nested ones."""

_DOUBLET_TILT_SHARE = 0.75
"""Share of max_tilt_deg that a doublet may use; wind and overshoot need the rest."""


class Config(Section):
    """Configuration of `companion`; the top level of the YAML file."""

    former_keys: ClassVar[Mapping[str, str]] = {
        "flight.programme": "is now called `flight.maneuvers`",
        "nmpc": "was removed with the acados solver: delete this section; guidance.kind: nmpc needs"
        " no key of its own, only the extra `nmpc`",
        **dict.fromkeys(
            ("line", "helix", "figure_eight", "waypoints", "csv"),
            "belongs in a trajectory file: name that file in flight.trajectory, or fly it with"
            " --trajectory FILE",
        ),
    }
    """Keys that were renamed or removed, or belong in another file, with what to do instead; see
    `Section.former_keys`."""

    link: LinkConfig = LinkConfig()
    planner: PlannerConfig = PlannerConfig()
    vehicle: VehicleConfig = VehicleConfig()
    limits: LimitsConfig = LimitsConfig()
    deadman: DeadmanConfig = DeadmanConfig()
    safety: SafetyConfig = SafetyConfig()
    guidance: GuidanceConfig = GuidanceConfig()
    thrust: ThrustConfig = ThrustConfig()
    flight: FlightConfig = FlightConfig()
    hover: HoverConfig = HoverConfig()
    steps: StepsConfig = StepsConfig()
    corners: CornersConfig = CornersConfig()
    circle: CircleConfig = CircleConfig()
    identify: IdentifyConfig = IdentifyConfig()
    realtime: RealtimeConfig = RealtimeConfig()
    recording: RecordingConfig = RecordingConfig()
    serve: ServeConfig = ServeConfig()
    mock: dict[str, Any] | None = None
    """Section for the mock vehicle; `python -m sitl_mock` reads it."""
    include: FileName | Annotated[tuple[FileName, ...], Field(max_length=MOST_INCLUDED)] = Field(
        default=(), exclude=True
    )
    """Files to include, relative to this file. Keys of this file override keys of included files.
    Included files may include others, up to four deep."""

    @property
    def planner_name(self) -> str:
        """Name of the planner that flies, with `auto` resolved."""
        if self.planner.name != AUTO:
            return self.planner.name
        return MODEL_FOLLOWING if self.vehicle.response_known else FIRST_ORDER

    @property
    def fence(self) -> Fence:
        """The fence that `limits` and `safety` describe; its `estimate_delay` is 0 s."""
        limits, safety = self.limits, self.safety
        return Fence(
            limits.fence_radius_m,
            limits.fence_ceiling_m,
            limits.fence_floor_m,
            safety.fence_polygon_m,
            safety.fence_polygon_deg,
            safety.braking_m_s2,
            safety.reaction_s,
            tilt_acceleration=limits.max_horizontal_acceleration,
        )

    @model_validator(mode="after")
    def _check_consistency(self) -> "Config":
        faults = list(_contradictions(self))
        if faults:
            raise ValueError("; ".join(faults))
        return self


def _contradictions(config: Config) -> Iterator[str]:
    """A message for each broken rule between sections."""
    limits, thrust, deadman = config.limits, config.thrust, config.deadman
    if config.planner.name == MODEL_FOLLOWING and not config.vehicle.response_known:
        yield "planner.name: model-following needs vehicle.lag_ms and vehicle.dead_time_ms"
    if not limits.min_thrust < thrust.hover_thrust < limits.max_thrust:
        yield "thrust.hover_thrust must lie between limits.min_thrust and limits.max_thrust"
    yield from _thrust_contradictions(config)
    if deadman.target_stale_ms < 2000.0 / config.guidance.rate_hz:
        yield "deadman.target_stale_ms must be at least two periods of guidance.rate_hz"
    if deadman.telemetry_stale_ms <= 1000.0 / config.link.attitude_rate_hz:
        yield "deadman.telemetry_stale_ms must be longer than a period of link.attitude_rate_hz"
    yield from _maneuver_contradictions(config)


def _thrust_contradictions(config: Config) -> Iterator[str]:
    """A message if the thrust cannot hold the height at the largest tilt."""
    limits, thrust = config.limits, config.thrust
    curve = ThrustCurve(thrust.curve_factor)
    hover_force = curve.share(thrust.hover_thrust)
    # An autopilot that compensates the tilt may use the full thrust.
    max_force = 1.0 if thrust.autopilot_compensates_tilt else curve.share(limits.max_thrust)
    tilt_deg = degrees(largest_tilt(hover_force, max_force))
    if hover_force >= max_force or tilt_deg >= limits.max_tilt_deg:
        return
    needed_force = hover_force / cos(limits.max_tilt) / TILT_THRUST_SHARE
    remedy = f"lower limits.max_tilt_deg to {max(1, floor(tilt_deg))}"
    if needed_force <= 1.0 and not thrust.autopilot_compensates_tilt:
        remedy += (
            f" or raise limits.max_thrust to {ceil(100.0 * curve.signal(needed_force)) / 100.0:.2f}"
        )
    yield (
        f"limits.max_tilt_deg {limits.max_tilt_deg:g} does not fit limits.max_thrust "
        f"{limits.max_thrust:g}: with thrust.hover_thrust {thrust.hover_thrust:g} the "
        f"vehicle holds its height only up to {tilt_deg:.0f}°; {remedy}"
    )


def _maneuver_contradictions(config: Config) -> Iterator[str]:
    """Messages about keys of the maneuvers that contradict other sections."""
    limits, flight, corners = config.limits, config.flight, config.corners
    largest_coefficient = sin(limits.max_tilt)
    if "steps" in flight.maneuvers and config.steps.coefficient > largest_coefficient:
        yield "steps.coefficient must not exceed the sine of limits.max_tilt_deg"
    corner_coefficient = hypot(corners.north_coefficient, corners.east_coefficient)
    if "corners" in flight.maneuvers and corner_coefficient > largest_coefficient:
        yield (
            f"√(corners.north_coefficient² + corners.east_coefficient²) is "
            f"{corner_coefficient:.3g}, and must not exceed the sine of limits.max_tilt_deg"
        )
    slows_down = "trajectory" in flight.maneuvers and flight.slow_down
    if slows_down and flight.slow_down_reserve_m_s2 >= limits.max_horizontal_acceleration:
        yield (
            f"flight.slow_down_reserve_m_s2 {flight.slow_down_reserve_m_s2:g} must be less "
            f"than the {limits.max_horizontal_acceleration:.2f} m/s² that limits.max_tilt_deg "
            f"{limits.max_tilt_deg:g} gives; lower it"
        )
    if "identify" in flight.maneuvers:
        yield from _identify_contradictions(config)


def _identify_contradictions(config: Config) -> Iterator[str]:
    """Messages about keys of `identify` that contradict other sections."""
    limits, identify = config.limits, config.identify
    if len(config.flight.maneuvers) > 1:
        yield "flight.maneuvers: identify must be the only maneuver of a flight"
    doublet_tilt_deg = identify.tilt_rate_deg_s * identify.tilt_duration_s
    if doublet_tilt_deg > _DOUBLET_TILT_SHARE * limits.max_tilt_deg:
        yield (
            "identify.tilt_rate_deg_s × identify.tilt_duration_s must not exceed "
            f"{_DOUBLET_TILT_SHARE} × limits.max_tilt_deg"
        )
    if identify.tilt_rate_deg_s > limits.max_tilt_rate_deg_s:
        yield "identify.tilt_rate_deg_s must not exceed limits.max_tilt_rate_deg_s"
    if identify.yaw_rate_deg_s > limits.max_yaw_rate_deg_s:
        yield "identify.yaw_rate_deg_s must not exceed limits.max_yaw_rate_deg_s"
