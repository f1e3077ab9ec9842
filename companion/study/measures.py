"""How good is a response: the numbers that stand in the tables, one per heading."""

import numpy as np

from companion.study.step import Floats, Response


def deviation(response: Response, reference: Floats) -> Floats:
    """(samples + 1, headings) distance from a reference of shape (samples + 1, 2)."""
    apart = response.coefficients - reference[:, :, None]
    return np.asarray(np.hypot(apart[:, 0], apart[:, 1]))


def largest_deviation(response: Response, reference: Floats) -> Floats:
    """(headings,) largest distance from a reference of shape (samples + 1, 2)."""
    return np.asarray(deviation(response, reference).max(axis=0))


def from_line(response: Response) -> Floats:
    """(samples + 1, headings) distance from the straight line start → target, to its right."""
    start, target = np.array(response.step.start), np.array(response.step.target)
    north, east = (target - start) / np.hypot(*(target - start))
    away = response.coefficients - start[:, None]
    return np.asarray(away[:, 1] * north - away[:, 0] * east)


def cross_track(response: Response) -> Floats:
    """(headings,) largest distance from the straight line between start and target."""
    return np.asarray(np.abs(from_line(response)).max(axis=0))


def time_to(response: Response, share: float = 0.05) -> Floats:
    """(headings,) time in s after which no more than `share` of the step is left; inf if never."""
    start, target = np.array(response.step.start), np.array(response.step.target)
    left = response.coefficients - target[:, None]
    beyond = np.hypot(left[:, 0], left[:, 1]) > share * np.hypot(*(target - start))
    last = beyond.shape[0] - np.argmax(beyond[::-1], axis=0)  # first sample after the last beyond
    arrived = np.where(beyond.any(axis=0), last, 0)
    time = response.step.time
    return np.where(arrived < len(time), time[np.minimum(arrived, len(time) - 1)], np.inf)


def largest_tilt_rate(response: Response) -> float:
    """Largest √(ω_x² + ω_y²) commanded at any heading, rad/s."""
    return float(response.tilt_rate.max())


def heading_effect(response: Response) -> float:
    """Largest difference between the paths at any two headings: 0 where heading does not matter."""
    c = response.coefficients
    return float((c.max(axis=2) - c.min(axis=2)).max())


def best_and_worst(values: Floats) -> tuple[int, int]:
    """Indices of the least and the largest of (headings,) values.

    Opposite headings are equal but for rounding: of those the first counts.
    """
    ranked = np.round(values, 9)
    return int(ranked.argmin()), int(ranked.argmax())
