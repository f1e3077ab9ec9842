"""Figure 2: the step response of every method against the first-order reference."""

from collections.abc import Iterator
from math import degrees

from matplotlib.figure import Figure

from companion.attitude import Quaternion, Target, comparison_laws
from companion.attitude.limits import Constants
from companion.attitude.planner import LawPlanner
from companion.study.drawing import (
    draw_line,
    draw_plane,
    draw_reference,
    draw_response,
    new_figure,
    note_magnification,
)
from companion.study.measures import (
    best_and_worst,
    cross_track,
    deviation,
    heading_effect,
    largest_deviation,
    settling_time,
)
from companion.study.methods import (
    EULER,
    LAW_METHODS,
    PAPER_METHODS,
    PROPOSED,
    QUATERNION,
    SO3,
    Method,
    planner_of,
)
from companion.study.outcome import Finding, Outcome, Row, Table, Tick
from companion.study.step import FIGURE_2, Floats, Response, fly

_EQUALITY_TOLERANCE = 1e-9
"""Difference below which the acceleration coefficients at two headings count as the same."""
PROGRESS_STEPS = len(LAW_METHODS) + 1


def _printed_quaternion_law(
    q: Quaternion, target: Target, dt: float, constants: Constants
) -> tuple[float, float, float]:
    """ω = 2p·vec(q_d ⊗ q⁻¹), the quaternion method with the attitude error of section 4.2.

    vec(q_d ⊗ q⁻¹) = q ⊗ vec(q⁻¹ ⊗ q_d) ⊗ q⁻¹ is the error in the world frame, a misprint for the
    error in the body frame. Used as body rates, this error shows the effect of the misprint.
    """
    w, x, y, z = q
    i, j, k = comparison_laws.quaternion(q, target, dt, constants)
    t_x, t_y, t_z = 2.0 * (y * k - z * j), 2.0 * (z * i - x * k), 2.0 * (x * j - y * i)
    return (
        i + w * t_x + y * t_z - z * t_y,
        j + w * t_y + z * t_x - x * t_z,
        k + w * t_z + x * t_y - y * t_x,
    )


def run(tick: Tick) -> Outcome:
    """Fly the step of figure 2 with every method at every heading."""
    reference = FIGURE_2.reference()
    responses = {}
    for method in LAW_METHODS:
        tick(method.label)
        responses[method] = fly(planner_of(method, FIGURE_2.gain), FIGURE_2)
    tick("the error as the paper prints it")
    printed_response = fly(
        LawPlanner(_printed_quaternion_law, planner_of(QUATERNION, FIGURE_2.gain).constants),
        FIGURE_2,
    )
    labelled_responses = {method.label: response for method, response in responses.items()}
    labelled_responses["quaternion, error q_d ⊗ q⁻¹ as printed"] = printed_response
    return Outcome(
        name="fig2",
        title="Figure 2: step response without limits",
        conditions=(
            "Coefficients step from (−0.4, −0.5) to (0.4, −0.5), p = 5 s⁻¹, 1000 Hz, body rates"
            " follow at once, 72 headings π/36 apart. The step is to the north, so a_E should"
            " stay at −0.5."
        ),
        figure=_figure(responses, reference),
        caption=(
            "Every method at one heading, for Euler angles the worst: both coefficients, distance"
            " from the first-order reference, and the path in the plane of the coefficients. In the"
            ' panels "Response, east" and "Path" the axis of a_E is magnified.'
        ),
        tables=(
            Table(
                "fig2",
                "Step response of figure 2. A method that depends on heading has two rows: for its"
                " best and for its worst heading.",
                tuple(
                    row
                    for label, response in labelled_responses.items()
                    for row in _rows(label, response, reference)
                ),
            ),
        ),
        findings=_findings(responses, printed_response, reference),
    )


def _rows(label: str, response: Response, reference: Floats) -> Iterator[Row]:
    deviations, heading_difference = (
        largest_deviation(response, reference),
        heading_effect(response),
    )
    shown_headings = {label: int(deviations.argmax())}
    if heading_difference >= _EQUALITY_TOLERANCE:
        shown_headings = {
            f"{label}, {rank} at {degrees(response.step.headings[index]):.0f}°": index
            for rank, index in zip(("best", "worst"), best_and_worst(deviations), strict=True)
        }
    for row_label, index in shown_headings.items():
        yield {
            "method": row_label,
            "largest deviation from first order": float(deviations[index]),
            "cross-track": float(cross_track(response)[index]),
            "time to 5 %, s": float(settling_time(response)[index]),
            "difference between headings": heading_difference,
        }


def _figure(responses: dict[Method, Response], reference: Floats) -> Figure:
    time = FIGURE_2.time
    _, worst_heading = best_and_worst(largest_deviation(responses[EULER], reference))
    shown_heading = {method: worst_heading if method is EULER else 0 for method in PAPER_METHODS}
    curves = [
        (
            method,
            f"{method.label} (worst heading)" if method is EULER else method.label,
            responses[method].at_heading(shown_heading[method]),
        )
        for method in PAPER_METHODS
    ]
    figure, ((north, east), (deviation_panel, plane)) = new_figure(2, 2)
    draw_response(north, east, time, curves)
    draw_reference(north, east, time, reference)
    for method in PAPER_METHODS:
        error = deviation(responses[method], reference)[:, shown_heading[method]]
        draw_line(deviation_panel, time, error, method.line_style)
    deviation_panel.set(
        title="Distance from the reference",
        xlabel="time, s",
        ylabel="|c − reference|",
        yscale="log",
        ylim=(1e-5, 0.1),
    )
    draw_plane(plane, curves, FIGURE_2)
    note_magnification(east, "this axis", east.get_ylim(), "that of north", north.get_ylim())
    note_magnification(
        plane, "the $a_E$ axis", plane.get_xlim(), "the $a_N$ axis", plane.get_ylim()
    )
    north.legend(loc="lower right")
    return figure


def _findings(
    responses: dict[Method, Response], printed_response: Response, reference: Floats
) -> tuple[Finding, ...]:
    deviations = {method: largest_deviation(responses[method], reference) for method in responses}
    heading_difference = {method: heading_effect(responses[method]) for method in responses}
    best_other = min(float(deviations[method].min()) for method in (QUATERNION, SO3, EULER))
    proposed_deviation = float(deviations[PROPOSED].max())
    return (
        Finding(
            "paper",
            "The proposed method follows the first-order reference; the others do not.",
            proposed_deviation < 0.2 * best_other,
            f"Largest deviation {proposed_deviation:.2g}. The best other method at its best heading"
            f" has {best_other:.2g}, {best_other / proposed_deviation:.0f} times as much (required:"
            " 5 times).",
        ),
        Finding(
            "paper",
            "Heading does not change the response of the proposed, the quaternion and the SO(3)"
            " method.",
            max(heading_difference[method] for method in (PROPOSED, QUATERNION, SO3))
            < _EQUALITY_TOLERANCE,
            "Largest difference of the paths between any two headings: "
            + ", ".join(
                f"{method.label} {heading_difference[method]:.1g}"
                for method in (PROPOSED, QUATERNION, SO3)
            )
            + ". The error must be taken in the body frame, q⁻¹ ⊗ q_d.",
        ),
        Finding(
            "ours",
            "Heading does not change the response of the quaternion method with the error"
            " q_d ⊗ q⁻¹, as the paper prints it.",
            heading_effect(printed_response) < _EQUALITY_TOLERANCE,
            f"With that error as body rates the paths at two headings differ by up to"
            f" {heading_effect(printed_response):.2g}, and the largest deviation is"
            f" {largest_deviation(printed_response, reference).max():.2g}.",
        ),
        Finding(
            "paper",
            "Heading changes the response of the Euler-angle method.",
            heading_difference[EULER] > _EQUALITY_TOLERANCE,
            f"Its largest deviation is {deviations[EULER].min():.2g} at the best heading and"
            f" {deviations[EULER].max():.2g} at the worst.",
        ),
    )
