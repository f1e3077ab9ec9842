"""What a planner may ask of the vehicle."""

from dataclasses import dataclass
from math import cos, inf, isfinite, pi
from typing import Literal

_LEAST = 1e-6
"""Least limit that is not taken for a slip: rad, rad/s."""


@dataclass(frozen=True, slots=True)
class Limits:
    """Bounds on tilt and body rates; `None` is no limit.

    Attributes:
        max_tilt: largest tilt of a target, rad, in (0, π/2).
        max_tilt_rate: W_M, largest √(ω_x² + ω_y²), rad/s.
        max_yaw_rate: largest |ω_z|, rad/s.
        shape: how W_M is kept. "tight" scales the tilt rate only where it would exceed W_M;
            "paper" bounds the coefficient rate by W_M·cos(max_tilt) (equation 33), which is slower.

    Raises:
        ValueError: a limit that is not positive and finite, a tilt of 90° or more, or the paper's
            shape without the tilt limit that it is computed from.
    """

    max_tilt: float | None = None
    max_tilt_rate: float | None = None
    max_yaw_rate: float | None = None
    shape: Literal["tight", "paper"] = "tight"

    def __post_init__(self) -> None:
        for name in ("max_tilt", "max_tilt_rate", "max_yaw_rate"):
            value = getattr(self, name)
            if value is not None and not (isfinite(value) and value >= _LEAST):
                raise ValueError(f"{name} must be positive and finite, not {value}")
        if self.max_tilt is not None and self.max_tilt >= pi / 2.0:
            raise ValueError(f"max_tilt must be below 90°, not {self.max_tilt:.4g} rad")
        if self.shape not in ("tight", "paper"):
            raise ValueError(
                f"shape of the rate limit must be 'tight' or 'paper', not {self.shape!r}"
            )
        if self.shape == "paper" and self.max_tilt_rate is not None and self.max_tilt is None:
            raise ValueError("the paper's rate limit needs max_tilt (equation 33)")

    @property
    def tilt_rate(self) -> float:
        """W_M in rad/s, infinite where there is no limit."""
        return inf if self.max_tilt_rate is None else self.max_tilt_rate

    @property
    def coefficient_speed(self) -> float:
        """Largest speed of the coefficients, 1/s: W_M·cos(max_tilt) in the paper's shape (33)."""
        if self.shape != "paper" or self.max_tilt is None:
            return inf
        return self.tilt_rate * cos(self.max_tilt)

    @property
    def yaw_rate(self) -> float:
        """Largest |ω_z| in rad/s, infinite where there is no limit."""
        return inf if self.max_yaw_rate is None else self.max_yaw_rate
