"""The YAML file of `companion study custom`: a step, the methods that fly it, and how."""

from math import hypot, radians, sin
from typing import Annotated, Literal

from pydantic import Field, model_validator

from companion.attitude import LAW_NAMES, Coefficients, Limits
from companion.files.yaml_file import Section
from companion.study.step import Step

Coefficient = Annotated[float, Field(gt=-1.0, lt=1.0)]
Pair = tuple[Coefficient, Coefficient]

MAX_STEPS = 5e6
"""Largest number of steps in a case, which need about 4 GB of memory; with inner_loop, less."""


class CaseLimits(Section):
    """Limits of the planners; null is no limit."""

    max_tilt_deg: Annotated[float, Field(ge=1.0, le=75.0)] | None = None
    """Largest tilt of the target."""
    max_tilt_rate_deg_s: Annotated[float, Field(ge=1.0, le=10_000.0)] | None = None
    """Largest roll-pitch rate, W_M in the paper."""
    max_yaw_rate_deg_s: Annotated[float, Field(ge=1.0, le=10_000.0)] | None = None
    """Largest yaw rate."""
    rate_limit: Literal["tight", "paper"] = "tight"
    """How first-order and exact keep max_tilt_rate_deg_s. tight: only rates above the limit are
    scaled. paper: equation 33, which needs max_tilt_deg."""


class Case(Section):
    """A step of the acceleration coefficients, the methods that fly it, and the conditions."""

    start: Pair
    """Acceleration coefficients [north, east] at the start; √(north² + east²) is sin(tilt)."""
    target: Pair
    """Acceleration coefficients [north, east] of the target."""
    headings_deg: Annotated[
        tuple[Annotated[float, Field(ge=-360.0, le=360.0)], ...],
        Field(min_length=1, max_length=360),
    ] = (0.0,)
    """Headings, by the tilt-yaw decomposition; the step is flown at each."""
    methods: Annotated[
        tuple[Annotated[str, Field(max_length=50)], ...],
        Field(min_length=1, max_length=len(LAW_NAMES)),
    ] = LAW_NAMES
    """Planners to compare."""
    rates_hz: Annotated[
        tuple[Annotated[float, Field(ge=10.0, le=1000.0)], ...],
        Field(min_length=1, max_length=100),
    ] = (250.0,)
    """Sample rates of the planner; with inner_loop each must divide 1000."""
    gain_per_s: Annotated[float, Field(gt=0.0, le=50.0)] = 5.0
    """Gain p of every method and of the first-order reference."""
    yaw_gain_per_s: Annotated[float, Field(ge=0.0, le=50.0)] = 2.0
    """Heading gain of first-order and exact; the others use gain_per_s, as in the paper."""
    seconds: Annotated[float, Field(ge=0.1, le=60.0)] = 2.0
    """Duration of the response."""
    limits: CaseLimits = CaseLimits()
    """Limits of the planners."""
    inner_loop: bool = False
    """True: fly with the mock vehicle's rate loop, rotors and rigid body. False: ideal rates."""
    quickness: Annotated[int, Field(ge=1, le=10)] = 1
    """Factor that divides all times of the inner loop; 1: it responds as measured on a PX4."""
    transport_delay_ms: Annotated[int, Field(ge=0, le=500)] = 0
    """Transport delay of the setpoints; needs inner_loop."""

    @model_validator(mode="after")
    def _step_makes_sense(self) -> "Case":
        for name, coefficients in (("start", self.start), ("target", self.target)):
            if hypot(*coefficients) >= sin(radians(75.0)):
                raise ValueError(f"{name} must be a tilt below 75°: √(north² + east²) below 0.966")
        if self.start == self.target:
            raise ValueError("start and target are the same: nothing to fly")
        tilt = self.limits.max_tilt_deg
        if self.limits.rate_limit == "paper" and tilt is None:
            raise ValueError("limits.rate_limit: paper needs limits.max_tilt_deg (equation 33)")
        if tilt is not None and hypot(*self.target) > sin(radians(tilt)) + 1e-12:
            raise ValueError("target lies beyond limits.max_tilt_deg")
        return self

    @model_validator(mode="after")
    def _lists_make_sense(self) -> "Case":
        unknown_names = [name for name in self.methods if name not in LAW_NAMES]
        if unknown_names:
            known_names = ", ".join(LAW_NAMES)
            raise ValueError(
                f"unknown method {unknown_names[0]!r} in methods; known: {known_names}"
            )
        for key in ("methods", "rates_hz"):
            if len(set(getattr(self, key))) < len(getattr(self, key)):
                raise ValueError(f"{key} has the same value twice")
        if self.steps_to_fly > MAX_STEPS:
            raise ValueError(
                f"{self.steps_to_fly:.0f} steps to fly, more than the {MAX_STEPS:.0f} that fit"
                " into memory; reduce headings_deg, methods, rates_hz or seconds"
            )
        return self

    @model_validator(mode="after")
    def _inner_loop_makes_sense(self) -> "Case":
        periods_ms = [1000.0 / hz for hz in self.rates_hz]
        if self.inner_loop and any(abs(ms - round(ms)) > 1e-9 for ms in periods_ms):
            raise ValueError("with inner_loop, each of rates_hz must divide 1000")
        for key in ("transport_delay_ms", "quickness"):
            if not self.inner_loop and getattr(self, key) != type(self).model_fields[key].default:
                raise ValueError(f"{key} needs inner_loop: true")
        return self

    @property
    def steps_to_fly(self) -> float:
        """Number of simulation steps of the whole case; with inner_loop, of physics steps."""
        total_s = len(self.headings_deg) * len(self.methods) * self.seconds
        if self.inner_loop:
            return total_s * len(self.rates_hz) * 1000.0 * self.quickness
        return total_s * sum(self.rates_hz)

    def step(self, rate_hz: float) -> Step:
        """The step of this case at one of its sample rates."""
        return Step(
            Coefficients(*self.start),
            Coefficients(*self.target),
            self.gain_per_s,
            rate_hz,
            self.seconds,
            tuple(radians(heading) for heading in self.headings_deg),
        )

    def planner_limits(self) -> Limits:
        """The limits of the planners in SI units."""
        limits = self.limits
        return Limits(
            _radians(limits.max_tilt_deg),
            _radians(limits.max_tilt_rate_deg_s),
            _radians(limits.max_yaw_rate_deg_s),
            limits.rate_limit,
        )


def _radians(angle_deg: float | None) -> float | None:
    return None if angle_deg is None else radians(angle_deg)
