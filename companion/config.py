"""The typed configuration: its sections together, and what no single one of them can know.

The defaults fly the bundled vehicle.
"""

from math import radians, sin, sqrt, tan
from typing import Any

from pydantic import model_validator

from companion.attitude.planner import MODEL_FOLLOWING
from companion.config_sections import (
    CircleConfig,
    CornersConfig,
    DeadmanConfig,
    FlightConfig,
    GuidanceConfig,
    HoverConfig,
    LimitsConfig,
    LinkConfig,
    PlannerConfig,
    RecordingConfig,
    StepsConfig,
    ThrustConfig,
    VehicleConfig,
)
from companion.guidance.reference import GRAVITY
from companion.yaml_file import Section


class Config(Section):
    """Configuration of `companion`; the top level of the YAML file."""

    link: LinkConfig = LinkConfig()
    planner: PlannerConfig = PlannerConfig()
    vehicle: VehicleConfig = VehicleConfig()
    limits: LimitsConfig = LimitsConfig()
    deadman: DeadmanConfig = DeadmanConfig()
    guidance: GuidanceConfig = GuidanceConfig()
    thrust: ThrustConfig = ThrustConfig()
    flight: FlightConfig = FlightConfig()
    hover: HoverConfig = HoverConfig()
    steps: StepsConfig = StepsConfig()
    corners: CornersConfig = CornersConfig()
    circle: CircleConfig = CircleConfig()
    recording: RecordingConfig = RecordingConfig()
    mock: dict[str, Any] | None = None
    """The bundled vehicle's own section, read by `python -m sitl_mock`; present only for it."""

    @model_validator(mode="after")
    def _consistent(self) -> "Config":
        faults = [text for wrong, text in _contradictions(self) if wrong]
        if faults:
            raise ValueError("; ".join(faults))
        return self


def _contradictions(config: Config) -> list[tuple[bool, str]]:
    """What no single section can know: (whether it is wrong, what to say)."""
    limits, thrust, flight = config.limits, config.thrust, config.flight
    circle, flown = config.circle, flight.programme
    tilt = radians(limits.max_tilt_deg)
    needed = circle.speed_m_s**2 / circle.radius_m + config.guidance.drag_per_s * circle.speed_m_s
    return [
        (
            config.planner.name == MODEL_FOLLOWING
            and None in (config.vehicle.lag_ms, config.vehicle.dead_time_ms),
            "planner.name: model-following needs vehicle.lag_ms and vehicle.dead_time_ms",
        ),
        (
            not limits.min_thrust < thrust.hover_thrust < limits.max_thrust,
            "thrust.hover_thrust must lie between limits.min_thrust and limits.max_thrust",
        ),
        (
            config.deadman.target_stale_ms < 2000.0 / config.guidance.rate_hz,
            "deadman.target_stale_ms must be at least two periods of guidance.rate_hz",
        ),
        (
            limits.fence_floor_m > flight.takeoff_height_m - 0.5,
            "limits.fence_floor_m must be at least 0.5 m below flight.takeoff_height_m",
        ),
        (
            "steps" in flown and config.steps.coefficient > sin(tilt),
            "steps.coefficient must not exceed the sine of limits.max_tilt_deg",
        ),
        (
            "corners" in flown and sqrt(2.0) * config.corners.coefficient > sin(tilt),
            "√2 × corners.coefficient must not exceed the sine of limits.max_tilt_deg",
        ),
        (
            "circle" in flown and needed > GRAVITY * tan(tilt),
            "circle.speed_m_s is too fast for circle.radius_m at limits.max_tilt_deg",
        ),
        (
            "circle" in flown and 2.0 * circle.radius_m > limits.fence_radius_m,
            "the circle (twice circle.radius_m away) leaves limits.fence_radius_m",
        ),
    ]
