"""The sections of the attitude law and of guidance."""

from typing import Annotated

from pydantic import Field, model_validator

from companion import plugins
from companion.attitude import PLANNER_NAMES
from companion.config.markers import TUNABLE
from companion.config.units import Si
from companion.drag import Drag
from companion.files.similar_names import name_hint
from companion.files.yaml_file import Section

AUTO = "auto"
LINEAR = "linear"
GUIDANCE_NAMES = (LINEAR, "nmpc")


def require_known_name(kind: str, name: str, our_names: tuple[str, ...], group: str) -> None:
    """Raise `ValueError` unless `name` is in `our_names` or a plug-in of `group` has it."""
    if name not in our_names and name not in (installed := plugins.names(group)):
        known_names = (*our_names, *installed)
        raise ValueError(
            f"unknown {kind} {name!r}; known: {', '.join(known_names)}"
            f"{name_hint(name, known_names)}"
        )


class PlannerConfig(Section):
    """The attitude law (planner) and its gains."""

    name: Annotated[
        str, Field(max_length=50, json_schema_extra={"enum": [AUTO, *PLANNER_NAMES]})
    ] = AUTO
    """auto: model-following if `vehicle` gives the response of the rate loop, else first-order.
    first-order: Algorithm 1 of Xu & Pei (Sensors 2026, 26(9), 2727). exact: the same without its
    discretisation error. model-following: predicts the vehicle's own rate loop, so that the
    response stays linear; needs `vehicle`. quaternion, so3, euler: the paper's comparison laws. A
    planner of another package is named by its entry point in `companion.planners`.
    """
    gain_per_s: Annotated[float, Field(ge=0.1, le=20.0, json_schema_extra=TUNABLE)] = 5.0
    """Gain p: the acceleration approaches its target with the time constant 1/p."""
    yaw_gain_per_s: Annotated[float, Field(ge=0.0, le=20.0, json_schema_extra=TUNABLE)] = 2.0
    """Gain of the heading: it approaches its target with the time constant 1/yaw_gain_per_s.
    quaternion, so3 and euler use gain_per_s instead.
    """

    @model_validator(mode="after")
    def _check_name(self) -> "PlannerConfig":
        require_known_name("planner", self.name, (AUTO, *PLANNER_NAMES), plugins.PLANNERS)
        return self


class GuidanceConfig(Section):
    """Guidance: turns a reference into attitude targets, without lag."""

    kind: Annotated[str, Field(max_length=50, json_schema_extra={"enum": list(GUIDANCE_NAMES)})] = (
        LINEAR
    )
    """linear: LQR position hold with a wind observer. nmpc: nonlinear model predictive control
    follows trajectories, in its own process (extra `nmpc`); linear guidance flies everything else,
    also while the solver gives no answer. Guidance of another package is named by its entry point
    in `companion.guidance`.
    """
    rate_hz: Annotated[float, Field(ge=10.0, le=100.0)] = 50.0
    """Rate at which guidance computes a new target."""
    position_weight_per_s4: Annotated[float, Field(ge=0.01, le=10000.0)] | None = Field(
        default=None, json_schema_extra=TUNABLE
    )
    """LQR weight of the horizontal position error relative to acceleration; a larger weight makes a
    stiffer position hold. null: k/T⁴.

    T is the delay of the attitude behind its target plus half a guidance period, at least 0.275 s.
    The delay follows from planner.gain_per_s and `vehicle`; an unknown rate loop counts as 0.12 s.

    k depends on a delay of the rate loop: dead time + lag/2 + half the time to slew to
    limits.max_tilt_rate_deg_s (0 without a slew limit). k is 2 up to 65 ms, 1 from 80 ms on or if
    the delay is unknown, and interpolated in between.
    """
    velocity_weight_per_s2: Annotated[float, Field(ge=0.0, le=10000.0)] | None = Field(
        default=None, json_schema_extra=TUNABLE
    )
    """LQR weight of the horizontal velocity error; a larger weight damps the position hold more.
    null: 1/T², T as in position_weight_per_s4.
    """
    disturbance_bandwidth_rad_s: Annotated[float, Field(ge=0.5, le=30.0)] | None = Field(
        default=None, json_schema_extra=TUNABLE
    )
    """Bandwidth of the wind observer, which compares the vehicle's motion with its tilt. Below the
    permitted range, wind would carry the vehicle away by metres. null: 1.5/T, T as in
    position_weight_per_s4. With a quick rate loop the bandwidth rises up to 2.4/T while the vehicle
    moves and its measured positions have little noise."""
    position_lateness_ms: Annotated[float, Field(ge=0.0, le=100.0)] = 0.0
    """Delay of the autopilot's position beyond what its estimator assumes, for example because of a
    wrong GPS delay parameter. Measure it against an independent position.
    """
    max_disturbance_m_s2: Annotated[float, Field(ge=0.0, le=20.0, json_schema_extra=TUNABLE)] = 6.0
    """Largest acceleration by wind that the observer may estimate."""
    lead: bool = True
    """Compute each target ahead of time, by the delay of the attitude response, so that the vehicle
    does not lag behind the reference."""
    height_gain_per_s: Annotated[float, Field(ge=0.0, le=20.0, json_schema_extra=TUNABLE)] = 1.5
    """Vertical speed commanded per metre of height error."""
    climb_gain_per_s: Annotated[float, Field(ge=0.0, le=20.0, json_schema_extra=TUNABLE)] = 3.5
    """Vertical acceleration commanded per m/s of vertical speed error."""
    drag_per_s: Annotated[float, Field(ge=0.0, le=10.0)] | None = None
    """Linear drag per mass, for feedforward. null: unknown. A flight estimates it, and the next
    flight of the vehicle begins with this estimate.
    """
    quadratic_drag_per_m: Annotated[float, Field(ge=0.0, le=1.0)] = 0.0
    """Quadratic drag per mass, used together with drag_per_s. The deceleration is (drag_per_s +
    quadratic_drag_per_m·speed)·speed.
    """

    position_lateness = Si("position_lateness_ms")

    @model_validator(mode="after")
    def _check_kind(self) -> "GuidanceConfig":
        require_known_name("guidance", self.kind, GUIDANCE_NAMES, plugins.GUIDANCE)
        return self

    @property
    def drag(self) -> Drag | None:
        """The configured drag, or None."""
        linear = self.drag_per_s
        return None if linear is None else Drag(linear, self.quadratic_drag_per_m)
