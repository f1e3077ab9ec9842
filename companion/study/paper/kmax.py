"""Appendix A: body rate per rate of the acceleration coefficients, by tilt and direction."""

from math import cos, degrees, pi, radians, sin
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

from companion.attitude import Coefficients
from companion.attitude.reference_model import rates_along
from companion.study.drawing import new_figure
from companion.study.methods import PROPOSED, REFERENCE_STYLE
from companion.study.outcome import Finding, Outcome, Table, Tick
from companion.study.step import Floats

TILTS = tuple(radians(angle) for angle in (0.0, 10.0, 20.0, 30.0, 40.0, 45.0, 50.0, 60.0))
PRINTED_K_MAX = {30: 1.333, 45: 2.0, 60: 4.0}
"""K_max as printed in the paper, by tilt in degrees."""

_LARGEST_TILT_SHOWN = radians(60.0)
_DIRECTIONS = 72
PROGRESS_STEPS = 2


_COLUMNS = (
    "tilt, °",
    "K_max computed",
    "1/(1 − 2A_M²)² = 1/cos² tilt, A_M = sin(tilt/2)",
    "K_min computed",
    "mean rate over largest rate",
)
"""Titles of the fields of `_Row`."""


class _Row(NamedTuple):
    """Scaling factor K (see `scaling_factor`) at one tilt, over all directions."""

    tilt_deg: int
    """Tilt, °."""
    largest_k: float
    """Largest K over all directions."""
    k_max: float
    """Bound of K by the formula of the paper."""
    smallest_k: float
    """Smallest K over all directions."""
    rate_share: float
    """Mean of the body rate over all directions, divided by its largest value."""


def scaling_factor(c: Coefficients, direction: float) -> float:
    """K = (ω_x² + ω_y²)/|ċ|² where the coefficients c move in `direction`, rad from north."""
    roll, pitch, _ = rates_along(c.north, c.east, cos(direction), sin(direction))
    return roll * roll + pitch * pitch


def k_max(max_tilt: float) -> float:
    """Appendix A: K_max = 1/(1 − 2A_M²)² with A_M = sin(max_tilt/2)."""
    return float((1.0 - 2.0 * sin(0.5 * max_tilt) ** 2) ** -2)


def run(tick: Tick) -> Outcome:
    """Compute the scaling factor K over tilts and directions, with the formulas used in flight."""
    tick("tilts")
    directions = np.linspace(0.0, 2.0 * pi, _DIRECTIONS, endpoint=False)
    by_tilt = {
        tilt: np.array([scaling_factor(Coefficients(sin(tilt), 0.0), d) for d in directions])
        for tilt in TILTS
    }
    tick("disc")
    rows: tuple[_Row, ...] = tuple(
        _Row(
            round(degrees(tilt)),
            float(k.max()),
            k_max(tilt),
            float(k.min()),
            float(np.sqrt(k).mean() / np.sqrt(k.max())),
        )
        for tilt, k in by_tilt.items()
    )
    return Outcome(
        name="kmax",
        title="Appendix A: the scaling factor K over the tilt disc",
        conditions=(
            "K = (ω_x² + ω_y²)/|ċ|² by the planner's kinematics, tilts to 60°, 72 directions"
            " of ċ. Equation 33 uses the largest K of all tilts and directions."
        ),
        figure=_figure(by_tilt),
        caption=(
            "Left: K for a movement to the north, by tilt. Right: the largest and the smallest K of"
            " all directions, by tilt; ● are the values that the paper prints."
        ),
        tables=(
            Table(
                "kmax",
                "Scaling factor by tilt.",
                tuple(dict(zip(_COLUMNS, row, strict=True)) for row in rows),
            ),
        ),
        findings=_findings(rows, by_tilt),
    )


def _findings(rows: tuple[_Row, ...], by_tilt: dict[float, Floats]) -> tuple[Finding, ...]:
    computed_k = {angle: float(by_tilt[radians(float(angle))].max()) for angle in PRINTED_K_MAX}
    rate_shares = {row.tilt_deg: row.rate_share for row in rows}
    return (
        Finding(
            "paper",
            "K_max = 1/(1 − 2A_M²)²: 1.333 at 30°, 2 at 45°, 4 at 60°.",
            all(
                abs(computed_k[angle] / value - 1.0) < 1e-3
                for angle, value in PRINTED_K_MAX.items()
            )
            and all(abs(row.largest_k / row.k_max - 1.0) < 1e-9 for row in rows),
            "Computed: " + ", ".join(f"{k:.4g} at {a}°" for a, k in computed_k.items()) + ".",
        ),
        Finding(
            "ours",
            "A movement in any direction needs K_max.",
            min(row.smallest_k / row.largest_k for row in rows) > 0.99,
            f"At {rows[-1].tilt_deg}° K is between {rows[-1].smallest_k:.3g} and"
            f" {rows[-1].largest_k:.3g}, depending on direction. The mean body rate is"
            f" {100.0 * rate_shares[40]:.0f} % of the largest at 40° of tilt"
            f" and {100.0 * rate_shares[60]:.0f} % at 60°.",
        ),
    )


def _figure(by_tilt: dict[float, Floats]) -> Figure:
    figure, ((disc_panel, tilt_panel),) = new_figure(1, 2, height=3.8)
    radii = np.linspace(0.0, sin(_LARGEST_TILT_SHOWN), 40)
    angles = np.linspace(0.0, 2.0 * pi, 73)
    k = np.array(
        [[scaling_factor(Coefficients(r * cos(b), r * sin(b)), 0.0) for b in angles] for r in radii]
    )
    north, east = np.outer(radii, np.cos(angles)), np.outer(radii, np.sin(angles))
    levels = np.linspace(1.0, 4.0, 13)
    filled_contours = disc_panel.contourf(east, north, k, levels=levels, cmap="cividis")
    contour_lines = disc_panel.contour(
        east, north, k, levels=[1.333, 2.0, 3.0], colors="white", linewidths=0.8
    )
    disc_panel.clabel(contour_lines, fmt="%.3g", fontsize=7)
    figure.colorbar(filled_contours, ax=disc_panel, label="K", ticks=[1, 2, 3, 4])
    disc_panel.set(
        title="K for a movement to the north", xlabel="$a_E$", ylabel="$a_N$", aspect="equal"
    )
    tilts = np.linspace(0.0, _LARGEST_TILT_SHOWN, 121)
    tilt_panel.plot(
        np.degrees(tilts), [k_max(t) for t in tilts], label="1/(1 − 2$A_M$²)²", **REFERENCE_STYLE
    )
    for extreme, marker, label in ((np.max, "s", "largest"), (np.min, "v", "smallest")):
        tilt_panel.plot(
            np.degrees(list(by_tilt)),
            [extreme(values) for values in by_tilt.values()],
            marker,
            color=PROPOSED.colour,
            markerfacecolor="none",
            label=f"{label} over the directions",
        )
    tilt_panel.plot(
        list(PRINTED_K_MAX),
        list(PRINTED_K_MAX.values()),
        "o",
        color="black",
        label="printed in the paper",
    )
    tilt_panel.set(title="K by tilt", xlabel="tilt, °", ylabel="K", ylim=(0.0, None))
    tilt_panel.legend(loc="upper left")
    return figure
