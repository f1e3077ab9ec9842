"""Scores of candidates: their errors, which cases stayed inside the envelope, and the best ones."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import inf, isfinite
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from companion.campaign.swept import Value
from companion.campaign.tune.candidates import Values

Floats = NDArray[np.float64]
Row = Mapping[str, Value]


class Score(NamedTuple):
    """The score of a candidate; each attribute has an entry for each case."""

    true_errors: tuple[float, ...]
    """RMS horizontal distance of the true position from the reference, m; infinite where a case was
    not flown to its end, or had no closed-loop maneuver."""
    estimated_errors: tuple[float, ...]
    """RMS horizontal distance of the estimated position from the reference, m; infinite where
    `true_errors` is."""
    estimator_errors: tuple[float, ...]
    """RMS horizontal distance of the estimated from the true position, m; infinite where
    `true_errors` is."""
    is_inside: tuple[bool, ...]
    """Whether each case was flown to its end and stayed inside the envelope."""

    @property
    def rms(self) -> float:
        """RMS of `true_errors` over all cases, m; infinite if a case was not flown to its end."""
        return pooled_rms(np.array(self.true_errors))

    @property
    def inside_share(self) -> float:
        """Share of the cases inside the envelope."""
        return sum(self.is_inside) / len(self.is_inside)

    def first_cases(self, count: int) -> "Score":
        """The score on the first `count` cases alone."""
        return Score._make(values[:count] for values in self)

    def combined_with(self, other_score: "Score") -> "Score":
        """The score on the cases of this score and of `other_score` together."""
        return Score._make(
            own_values + other_values
            for own_values, other_values in zip(self, other_score, strict=True)
        )


@dataclass(frozen=True)
class Candidate:
    """A candidate that has flown all its cases."""

    number: int
    values: Values
    score: Score
    """Score on the cases of the search."""


@dataclass
class SearchResults:
    """The results of a search so far."""

    tried_count: int = 0
    """Number of all candidates, including those of `stopped_early_count`."""
    stopped_early_count: int = 0
    """Number of candidates that were abandoned, or whose keys were refused."""
    best: Candidate | None = None
    """Candidate with the smallest error of those that met the constraint, `inside_share`; None:
    none met it."""
    near_best: list[Candidate] = field(default_factory=list)
    """The best tenth, or at least the best three, of the candidates that met the constraint
    `inside_share`; the best first."""


def score_of(rows: Sequence[Row], envelope: float | None) -> Score:
    """The score computed from rows of results, one for each case.

    `envelope` is the largest true distance from the reference inside the envelope, m; None: no
    limit.
    """
    return Score(
        tuple(_number(row, "level_rms_m") for row in rows),
        tuple(_number(row, "estimated_level_rms_m") for row in rows),
        tuple(_number(row, "estimate_level_rms_m") for row in rows),
        tuple(_is_inside(row, envelope) for row in rows),
    )


def pooled_rms(rms: Floats) -> float:
    """RMS over all cases, from the RMS error of each case."""
    return float(np.sqrt(np.mean(np.square(rms))))


def _number(row: Row, name: str) -> float:
    value = row.get(name)
    flown_to_end = row.get("result") == "ok" and not row.get("crashed")
    return float(value) if flown_to_end and isinstance(value, float) else inf


def _is_inside(row: Row, envelope: float | None) -> bool:
    if not isfinite(_number(row, "level_rms_m")):
        return False
    return envelope is None or _number(row, "position_max_m") <= envelope
