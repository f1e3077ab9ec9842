"""The study `custom`: methods compared on a step that the user defines in a file."""

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path

from matplotlib.figure import Figure

from companion.attitude.reference import FirstOrderReference
from companion.files import yaml_file
from companion.study.custom_case import Case
from companion.study.drawing import (
    draw_line,
    draw_plane,
    draw_reference,
    draw_response,
    label_tilt_rate,
    new_figure,
)
from companion.study.inner_loop import faster_inner_loop
from companion.study.measures import (
    cross_track,
    deviation,
    heading_effect,
    largest_deviation,
    largest_tilt_rate,
    settling_time,
    signed_distance_from_line,
)
from companion.study.methods import LAW_METHODS, LIMIT_STYLE, Method, planner_of
from companion.study.outcome import Job, Outcome, Row, Table, Tick
from companion.study.step import Floats, Response, fly, fly_loop

Responses = dict[tuple[Method, float], Response]
"""Response by method and sample rate (Hz)."""


def prepare(case_file: Path) -> Job:
    """Read a case from a file, and return the job that flies it.

    Raises:
        ConfigError: the file cannot be read, or the case is invalid.
    """
    case = yaml_file.load(case_file, Case)
    return Job(partial(_run, case), len(case.methods) * len(case.rates_hz))


def _run(case: Case, tick: Tick) -> Outcome:
    """Fly the case with each of its methods at each of its rates."""
    responses: Responses = {}
    for hz in case.rates_hz:
        for method in LAW_METHODS:
            if method.planner in case.methods:
                tick(f"{method.label} at {hz:g} Hz")
                responses[method, hz] = _fly(case, method, hz)
    return Outcome(
        name="custom",
        title="Custom case",
        conditions=_conditions(case),
        figure=_figure(case, responses),
        caption=(
            f"Every method at {case.rates_hz[0]:g} Hz, at the heading with its largest cross-track."
            f" The reference is {_reference_text(case)}."
        ),
        tables=(_results(case, responses),),
        series=(_responses(case, responses),),
    )


def _results(case: Case, responses: Responses) -> Table:
    """The table of the largest errors and rates of each method at each sample rate."""
    heading_count = len(case.headings_deg)
    reference = _reference_text(case)
    return Table(
        "custom",
        "The custom case; largest values over"
        f" {heading_count} heading{'s' if heading_count > 1 else ''}, rates as commanded.",
        tuple(
            {
                "method": method.label,
                "rate, Hz": hz,
                "cross-track": float(cross_track(response).max()),
                f"largest deviation from {reference}": float(
                    largest_deviation(response, _reference(case, hz)).max()
                ),
                "time to 5 %, s": float(settling_time(response).max()),
                "largest √(ω_x²+ω_y²), rad/s": largest_tilt_rate(response),
                "difference between headings": heading_effect(response),
            }
            for (method, hz), response in responses.items()
        ),
    )


def _responses(case: Case, responses: Responses) -> Table:
    """The table of every sample of every response."""
    return Table(
        "custom-response",
        "Every sample of every response; rates are held until the next sample.",
        tuple(row for key, response in responses.items() for row in _samples(case, *key, response)),
    )


def _samples(case: Case, method: Method, hz: float, response: Response) -> Iterator[Row]:
    """Table rows of one response: coefficients and commanded body rates of each sample."""
    for index, heading in enumerate(case.headings_deg):
        columns = (
            ("time, s", response.step.time[:-1]),
            *zip(("a_N", "a_E"), response.at_heading(index)[:-1].T, strict=True),
            *zip(("ω_x", "ω_y", "ω_z"), response.rates[:, :, index].T, strict=True),
        )
        for k in range(response.step.samples):
            yield {
                "method": method.label,
                "rate, Hz": hz,
                "heading, °": heading,
                **{name: float(values[k]) for name, values in columns},
            }


def _fly(case: Case, method: Method, rate_hz: float) -> Response:
    planner = planner_of(method, case.gain_per_s, case.planner_limits(), case.yaw_gain_per_s)
    step = case.step(rate_hz)
    if case.inner_loop:
        inner_loop = replace(
            faster_inner_loop(case.quickness), transport_delay=1e-3 * case.transport_delay_ms
        )
        return fly_loop(planner, step, inner_loop)
    return fly(planner, step)


def _reference(case: Case, rate_hz: float) -> Floats:
    """(samples + 1, 2) coefficients of the first-order reference.

    With `rate_limit: paper` equation 33 of the paper limits how fast the reference moves.
    """
    model = FirstOrderReference(case.gain_per_s, case.planner_limits().coefficient_speed)
    return case.step(rate_hz).reference(model)


def _reference_text(case: Case) -> str:
    is_limited = case.limits.rate_limit == "paper"
    return "first order " + ("with the limit of equation 33" if is_limited else "without limits")


def _conditions(case: Case) -> str:
    loop_text = "body rates follow at once"
    if case.inner_loop:
        loop_text = (
            f"complete inner loop, {case.quickness} times as fast as measured,"
            f" after {case.transport_delay_ms} ms of transport delay"
        )
    limits_text = ", ".join(
        f"{key} {value}" for key, value in case.limits.model_dump().items() if value is not None
    )
    return (
        f"Coefficients step from {list(case.start)} to {list(case.target)} in {case.seconds:g} s,"
        f" p = {case.gain_per_s:g} s⁻¹, heading gain {case.yaw_gain_per_s:g} s⁻¹; rates"
        f" {list(case.rates_hz)} Hz; headings {list(case.headings_deg)}°; {loop_text}; limits:"
        f" {limits_text}."
    )


def _figure(case: Case, responses: Responses) -> Figure:
    hz = case.rates_hz[0]
    step, reference = case.step(hz), _reference(case, hz)
    shown_responses = {
        method: response for (method, rate), response in responses.items() if rate == hz
    }
    worst_heading = {m: int(cross_track(r).argmax()) for m, r in shown_responses.items()}
    curves = [(m, m.label, r.at_heading(worst_heading[m])) for m, r in shown_responses.items()]
    figure, ((north, east), (plane, from_straight_line), (from_reference, rate)) = new_figure(
        3, 2, height=3.0
    )
    draw_response(north, east, step.time, curves)
    draw_reference(north, east, step.time, reference, _reference_text(case))
    draw_plane(plane, curves, step)
    for m, response in shown_responses.items():
        draw_line(
            from_straight_line,
            step.time,
            signed_distance_from_line(response)[:, worst_heading[m]],
            m.line_style,
        )
        draw_line(
            from_reference,
            step.time,
            deviation(response, reference)[:, worst_heading[m]],
            m.line_style,
        )
        draw_line(rate, step.time[:-1], response.tilt_rate[:, worst_heading[m]], m.line_style)
    from_straight_line.set(title="Distance from the line", xlabel="time, s", ylabel="to its right")
    from_reference.set(
        title="Distance from the reference", xlabel="time, s", ylabel="|c − reference|"
    )
    label_tilt_rate(rate, "Tilt rate commanded")
    limit = case.planner_limits().max_tilt_rate
    if limit is not None:
        rate.axhline(limit, **LIMIT_STYLE)
    north.legend()
    return figure
