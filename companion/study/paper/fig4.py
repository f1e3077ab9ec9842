"""Figure 4: the step under a limit of the tilt rate."""

from dataclasses import replace
from math import pi, radians

from matplotlib.figure import Figure

from companion.attitude import Limits
from companion.attitude.reference import FirstOrderReference
from companion.study.drawing import (
    draw_line,
    draw_plane,
    draw_reference,
    draw_response,
    label_tilt_rate,
    new_figure,
)
from companion.study.measures import (
    cross_track,
    largest_deviation,
    largest_tilt_rate,
    settling_time,
)
from companion.study.methods import (
    EULER,
    LIMIT_STYLE,
    PAPER_LIMIT,
    PROPOSED,
    QUATERNION,
    SO3,
    Method,
    planner_of,
)
from companion.study.outcome import Finding, Outcome, Row, Table, Tick
from companion.study.step import FIGURE_4, Floats, Response, fly

MAX_TILT = radians(40.0)
MAX_TILT_RATE = pi / 2.0

_METHODS = (QUATERNION, SO3, EULER, PROPOSED, PAPER_LIMIT)
PROGRESS_STEPS = len(_METHODS)


def run(tick: Tick) -> Outcome:
    """Fly the step of figure 4 with every method, and `first-order` with both forms of limit."""
    tight_limits = Limits(MAX_TILT, MAX_TILT_RATE)
    paper_limits = replace(tight_limits, shape="paper")
    responses = {}
    for method in _METHODS:
        tick(method.label)
        limits = paper_limits if method is PAPER_LIMIT else tight_limits
        responses[method] = fly(planner_of(method, FIGURE_4.gain, limits), FIGURE_4)
    reference = FIGURE_4.reference(
        FirstOrderReference(FIGURE_4.gain, paper_limits.coefficient_speed)
    )
    return Outcome(
        name="fig4",
        title="Figure 4: step response with the tilt rate limited",
        conditions=(
            "Coefficients step from (−0.5, 0) to (0, 0.5), p = 5 s⁻¹, 1000 Hz, tilt limit 40°,"
            " W_M = π/2 rad/s, 72 headings. The paper bounds the coefficients' rate by"
            " W_M·cos 40° (equation 33); the tight limit scales the tilt rate only where it would"
            " exceed W_M."
        ),
        figure=_figure(responses, reference),
        caption=(
            "Response, path, and √(ω_x² + ω_y²) with its limit; Euler angles at the slowest"
            " heading. The reference is first order with the limit of equation 33."
        ),
        tables=(
            Table(
                "fig4",
                "Step response of figure 4 under W_M = π/2 rad/s; largest values over 72 headings.",
                tuple(_row(method, responses[method], reference) for method in _METHODS),
            ),
        ),
        findings=_findings(responses, reference),
    )


def _row(method: Method, response: Response, reference: Floats) -> Row:
    deviation = float(largest_deviation(response, reference).max())
    return {
        "method": method.label,
        "largest √(ω_x²+ω_y²), rad/s": largest_tilt_rate(response),
        "time to 5 %, s": float(settling_time(response).max()),
        "cross-track": float(cross_track(response).max()),
        "largest deviation from the reference of equation 33": deviation,
    }


def _figure(responses: dict[Method, Response], reference: Floats) -> Figure:
    time = FIGURE_4.time
    slowest_heading = int(settling_time(responses[EULER]).argmax())
    shown_heading = {method: slowest_heading if method is EULER else 0 for method in _METHODS}
    curves = [
        (method, method.label, responses[method].at_heading(shown_heading[method]))
        for method in _METHODS
    ]
    figure, ((north, east), (rate_panel, plane)) = new_figure(2, 2)
    draw_response(north, east, time, curves)
    for method, response in responses.items():
        tilt_rate = response.tilt_rate[:, shown_heading[method]]
        draw_line(rate_panel, time[:-1], tilt_rate, method.line_style)
    draw_reference(north, east, time, reference, "reference, equation 33")
    rate_panel.axhline(MAX_TILT_RATE, **LIMIT_STYLE)
    label_tilt_rate(rate_panel, "Tilt rate and its limit")
    rate_panel.set(xlim=(0.0, 1.2), ylim=(0.0, 1.8))
    draw_plane(plane, curves, FIGURE_4)
    north.legend(loc="lower right")
    return figure


def _findings(responses: dict[Method, Response], reference: Floats) -> tuple[Finding, ...]:
    rate = {method: largest_tilt_rate(responses[method]) for method in _METHODS}
    settling_times = {method: float(settling_time(responses[method]).max()) for method in _METHODS}
    cross_tracks = {method: float(cross_track(responses[method]).max()) for method in _METHODS}
    paper_limit_deviation = float(largest_deviation(responses[PAPER_LIMIT], reference).max())
    euler_settling_times = settling_time(responses[EULER])
    return (
        Finding(
            "paper",
            "The limit of equation 33 keeps the tilt rate within W_M.",
            rate[PAPER_LIMIT] <= MAX_TILT_RATE * (1.0 + 1e-12),
            f"The largest is {rate[PAPER_LIMIT]:.3f} of {MAX_TILT_RATE:.3f} rad/s; the response"
            f" follows the limited first-order reference within {paper_limit_deviation:.2g}.",
        ),
        Finding(
            "ours",
            "The limit of equation 33 makes full use of W_M.",
            rate[PAPER_LIMIT] > 0.99 * MAX_TILT_RATE,
            f"It uses {100.0 * rate[PAPER_LIMIT] / MAX_TILT_RATE:.0f} % of W_M and takes"
            f" {settling_times[PAPER_LIMIT]:.3f} s; the tight limit uses"
            f" {100.0 * rate[PROPOSED] / MAX_TILT_RATE:.0f} % and takes"
            f" {settling_times[PROPOSED]:.3f} s, along the same straight line (cross-track"
            f" {cross_tracks[PROPOSED]:.2g}).",
        ),
        Finding(
            "ours",
            "Under the limit the proposed method is the quickest.",
            min(settling_times, key=lambda method: settling_times[method])
            in (PROPOSED, PAPER_LIMIT),
            f"so3 takes {settling_times[SO3]:.3f} s, the quaternion method"
            f" {settling_times[QUATERNION]:.3f} s, euler {euler_settling_times.min():.3f} to"
            f" {euler_settling_times.max():.3f} s"
            f" by heading, first-order {settling_times[PROPOSED]:.3f} s. so3 leaves the straight"
            f" line by {cross_tracks[SO3]:.2g}, first-order by {cross_tracks[PROPOSED]:.2g}.",
        ),
    )
