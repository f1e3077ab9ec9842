"""The same comparison on a case of one's own, from a YAML file."""

from math import degrees, radians
from typing import Annotated, Literal

import numpy as np
from matplotlib.figure import Figure
from pydantic import BaseModel, ConfigDict, Field, model_validator

from companion.attitude import PLANNER_NAMES, Coefficients, Limits
from companion.attitude.reference import FirstOrderReference
from companion.study.drawing import draw, draw_plane, draw_reference, draw_response, new_figure
from companion.study.inner_loop import InnerLoop
from companion.study.measures import (
    cross_track,
    deviation,
    heading_effect,
    largest_deviation,
    largest_tilt_rate,
    time_to,
)
from companion.study.methods import BY_PLANNER, REFERENCE, Method, planner_of
from companion.study.outcome import Outcome, Tick
from companion.study.step import Floats, Response, Step, fly, fly_inner_loop
from companion.study.table import Table

Coefficient = Annotated[float, Field(gt=-1.0, lt=1.0)]
Pair = tuple[Coefficient, Coefficient]


class _Section(BaseModel):
    """Immutable, unknown keys refused, every key described."""

    model_config = ConfigDict(
        extra="forbid", frozen=True, allow_inf_nan=False, use_attribute_docstrings=True
    )


class CaseLimits(_Section):
    """Limits of the planners; null is no limit."""

    max_tilt_deg: Annotated[float, Field(gt=0.0, le=75.0)] | None = None
    """Largest tilt of the target."""
    max_tilt_rate_deg_s: Annotated[float, Field(gt=0.0)] | None = None
    """W_M, largest roll-pitch rate."""
    max_yaw_rate_deg_s: Annotated[float, Field(gt=0.0)] | None = None
    """Largest yaw rate."""
    rate_limit: Literal["tight", "paper"] = "tight"
    """Which limit the proposed method uses; paper: equation 33, needs max_tilt_deg."""


class Case(_Section):
    """A step of the coefficients, and who shall fly it how."""

    start: Pair
    """Acceleration coefficients [north, east] at the start; their length is sin(tilt)."""
    target: Pair
    """Acceleration coefficients [north, east] of the target."""
    headings_deg: Annotated[tuple[float, ...], Field(min_length=1, max_length=360)] = (0.0,)
    """Tilt-yaw headings at which it is flown."""
    methods: Annotated[tuple[str, ...], Field(min_length=1)] = PLANNER_NAMES
    """Planners to compare."""
    rates_hz: Annotated[
        tuple[Annotated[float, Field(ge=10.0, le=1000.0)], ...], Field(min_length=1)
    ] = (250.0,)
    """Sample rates of the planner; with the inner loop each must divide 1000."""
    gain_per_s: Annotated[float, Field(gt=0.0, le=50.0)] = 5.0
    """p of every method and of the first-order reference."""
    yaw_gain_per_s: Annotated[float, Field(ge=0.0, le=50.0)] = 2.0
    """Heading gain of first-order and exact; the others use gain_per_s, as in the paper."""
    seconds: Annotated[float, Field(gt=0.0, le=60.0)] = 2.0
    """How long it is watched."""
    limits: CaseLimits = CaseLimits()
    """Limits of the planners."""
    inner_loop: bool = False
    """Fly the bundled vehicle's rate loop, rotors and rigid body instead of ideal kinematics."""
    transport_delay_ms: Annotated[float, Field(ge=0.0, le=500.0)] = 0.0
    """Delay of the setpoints on their way, with the inner loop only."""

    @model_validator(mode="after")
    def _consistent(self) -> "Case":
        unknown = [name for name in self.methods if name not in BY_PLANNER]
        if unknown:
            known = ", ".join(BY_PLANNER)
            raise ValueError(f"unknown method {unknown[0]!r} in methods; known: {known}")
        if len(set(self.methods)) < len(self.methods):
            raise ValueError("methods names one twice")
        for name, end in (("start", self.start), ("target", self.target)):
            if np.hypot(*end) >= np.sin(radians(75.0)):
                raise ValueError(f"{name} must be a tilt below 75°: shorter than 0.966")
        if self.start == self.target:
            raise ValueError("start and target are the same: nothing to fly")
        tilt = self.limits.max_tilt_deg
        if self.limits.rate_limit == "paper" and tilt is None:
            raise ValueError("limits.rate_limit: paper needs limits.max_tilt_deg (equation 33)")
        if tilt is not None and np.hypot(*self.target) > np.sin(radians(tilt)) + 1e-12:
            raise ValueError("target lies beyond limits.max_tilt_deg")
        if self.inner_loop and any((1000.0 / hz) % 1.0 > 1e-9 for hz in self.rates_hz):
            raise ValueError("with inner_loop every one of rates_hz must divide 1000")
        if self.transport_delay_ms and not self.inner_loop:
            raise ValueError("transport_delay_ms needs inner_loop: true")
        return self

    def step(self, rate_hz: float) -> Step:
        """The step at one of the rates."""
        return Step(
            Coefficients(*self.start),
            Coefficients(*self.target),
            self.gain_per_s,
            rate_hz,
            self.seconds,
            tuple(radians(heading) for heading in self.headings_deg),
        )

    def planner_limits(self) -> Limits:
        """The limits in SI."""
        limits = self.limits
        return Limits(
            _radians(limits.max_tilt_deg),
            _radians(limits.max_tilt_rate_deg_s),
            _radians(limits.max_yaw_rate_deg_s),
            limits.rate_limit,
        )


def _radians(angle_deg: float | None) -> float | None:
    return None if angle_deg is None else radians(angle_deg)


def parts(case: Case) -> int:
    """How many times `run` ticks."""
    return len(case.methods) * len(case.rates_hz)


def run(case: Case, tick: Tick) -> Outcome:
    """Fly the case with all of its methods at all of its rates."""
    flown: dict[tuple[Method, float], Response] = {}
    for hz in case.rates_hz:
        for method in (m for name, m in BY_PLANNER.items() if name in case.methods):
            tick(f"{method.label} at {hz:g} Hz")
            flown[method, hz] = _fly(case, method, hz)
    several = len(case.rates_hz) > 1
    return Outcome(
        name="custom",
        title="Custom case",
        conditions=_conditions(case),
        figure=_figure(case, flown),
        caption=(
            f"Every method{f' at {case.rates_hz[0]:g} Hz' if several else ''}, at the heading"
            " where it deviates most from the reference."
        ),
        tables=(
            Table(
                "custom",
                f"Largest values over {len(case.headings_deg)} heading(s).",
                (
                    "method",
                    "rate, Hz",
                    "largest deviation from the reference",
                    "cross-track",
                    "time to 5 %, s",
                    "largest √(ω_x²+ω_y²), rad/s",
                    "difference between headings",
                ),
                tuple(
                    (
                        method.label,
                        hz,
                        float(largest_deviation(response, _reference(case, hz)).max()),
                        float(cross_track(response).max()),
                        float(time_to(response).max()),
                        largest_tilt_rate(response),
                        heading_effect(response),
                    )
                    for (method, hz), response in flown.items()
                ),
            ),
        ),
    )


def _fly(case: Case, method: Method, rate_hz: float) -> Response:
    planner = planner_of(method, case.gain_per_s, case.planner_limits(), case.yaw_gain_per_s)
    step = case.step(rate_hz)
    if case.inner_loop:
        return fly_inner_loop(
            planner, step, InnerLoop(transport_delay=1e-3 * case.transport_delay_ms)
        )
    return fly(planner, step)


def _reference(case: Case, rate_hz: float) -> Floats:
    """First order, with the limit of equation 33 where the case asks for it."""
    limits = case.planner_limits()
    model = FirstOrderReference(case.gain_per_s)
    if limits.shape == "paper" and limits.max_tilt is not None:
        model = FirstOrderReference(case.gain_per_s, limits.tilt_rate * np.cos(limits.max_tilt))
    return case.step(rate_hz).reference(model)


def _conditions(case: Case) -> str:
    way = f"from {case.start} to {case.target}"
    headings = len(case.headings_deg)
    loop = "body rates follow at once"
    if case.inner_loop:
        loop = "complete inner loop"
        if case.transport_delay_ms:
            loop += f" after {case.transport_delay_ms:g} ms of transport delay"
    limits = case.planner_limits()
    bounds = [
        f"{name} {degrees(value):.4g}°{unit}"
        for name, value, unit in (
            ("tilt", limits.max_tilt, ""),
            ("tilt rate", limits.max_tilt_rate, "/s"),
            ("yaw rate", limits.max_yaw_rate, "/s"),
        )
        if value is not None
    ]
    limited = f"limits: {', '.join(bounds)} ({limits.shape})" if bounds else "no limits"
    return (
        f"Coefficients step {way}, p = {case.gain_per_s:g} s⁻¹, {headings} heading(s),"
        f" {loop}, {limited}."
    )


def _figure(case: Case, flown: dict[tuple[Method, float], Response]) -> Figure:
    hz = case.rates_hz[0]
    step, reference = case.step(hz), _reference(case, hz)
    shown = {method: response for (method, rate), response in flown.items() if rate == hz}
    at = {m: int(largest_deviation(r, reference).argmax()) for m, r in shown.items()}
    curves = [(m, m.label, r.at(at[m])) for m, r in shown.items()]
    figure, axes = new_figure(2, 3, width=4.0)
    (north, east, plane), (away, rate, unused) = axes
    draw_response(north, east, step.time, curves)
    draw_reference(north, east, step.time, reference)
    draw_plane(plane, curves, np.array([step.start, step.target]))
    for m, response in shown.items():
        draw(away, step.time, deviation(response, reference)[:, at[m]], m.line)
        draw(rate, step.time[:-1], response.tilt_rate[:, at[m]], m.line)
    away.set(title="Distance from the reference", xlabel="time, s", ylabel="|c − reference|")
    rate.set(
        title="Tilt rate commanded",
        xlabel="time, s",
        ylabel=r"$\sqrt{\omega_x^2+\omega_y^2}$, rad/s",
    )
    limit = case.planner_limits().max_tilt_rate
    if limit is not None:
        rate.axhline(limit, **REFERENCE)
    unused.set_axis_off()
    unused.legend(*north.get_legend_handles_labels(), loc="center")
    return figure
