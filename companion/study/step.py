"""A step of the target coefficients, and the response of a planner to it.

The paper is Xu & Pei; see `companion.attitude`.
"""

from dataclasses import dataclass
from math import pi
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from companion import batch
from companion.attitude import Coefficients, Planner, Quaternion, Target, attitude
from companion.attitude.planner import LawPlanner
from companion.attitude.reference import FirstOrderReference

Floats = NDArray[np.float64]

ALL_HEADINGS = tuple(k * pi / 36.0 for k in range(-35, 37))
"""Headings of figure 3 of the paper (Xu & Pei), every π/36; rad."""


@dataclass(frozen=True)
class Step:
    """A step from one steady tilt to another, flown at several headings."""

    start: Coefficients
    """Acceleration coefficients (north, east) before the step."""
    target: Coefficients
    """Acceleration coefficients (north, east) of the target."""
    gain: float = 5.0
    """Gain p of the planners and of the first-order reference, 1/s."""
    rate_hz: float = 1000.0
    """Sample rate of the planner."""
    seconds: float = 2.0
    """Duration of the response, s."""
    headings: tuple[float, ...] = ALL_HEADINGS
    """Headings of the tilt-yaw decomposition, rad; each is held during one flight."""

    @property
    def samples(self) -> int:
        """Number of samples of the planner."""
        return round(self.seconds * self.rate_hz)

    @property
    def time(self) -> Floats:
        """(samples + 1,) time after the step, s."""
        return np.arange(self.samples + 1) / self.rate_hz

    def reference(self, model: FirstOrderReference | None = None) -> Floats:
        """(samples + 1, 2) coefficients of a reference model; None: first order with `gain`."""
        model = model or FirstOrderReference(self.gain)
        return np.array([model.after(self.start, self.target, float(t)) for t in self.time])


FIGURE_2 = Step(Coefficients(-0.4, -0.5), Coefficients(0.4, -0.5))
"""The step of the paper's figures 2, 3 and 5."""
FIGURE_4 = Step(Coefficients(-0.5, 0.0), Coefficients(0.0, 0.5))
"""The step of the paper's figure 4, where the rate limit is active."""


@dataclass(frozen=True)
class Response:
    """The response of one planner to a step, sample by sample, at each heading."""

    step: Step
    """The step that was flown."""
    coefficients: Floats
    """(samples + 1, 2, headings), acceleration coefficients of the attitude."""
    rates: Floats
    """(samples, 3, headings), commanded body rates, rad/s."""

    @property
    def tilt_rate(self) -> Floats:
        """(samples, headings) commanded √(ω_x² + ω_y²), rad/s."""
        return np.hypot(self.rates[:, 0], self.rates[:, 1])

    def at_heading(self, heading_index: int) -> Floats:
        """(samples + 1, 2) coefficients at one heading."""
        return self.coefficients[:, :, heading_index]


class LoopFlight(NamedTuple):
    """A flight with an inner loop, at one heading of the step; body rates (FRD) in rad/s."""

    q: Floats
    """(samples + 1, 4), attitude (w, x, y, z), body → world (NED)."""
    commanded_rates: Floats
    """(samples, 3), rates commanded at each sample, before any delay."""
    body_rates: Floats
    """(samples + 1, 3), true rates of the vehicle."""


class Loop(Protocol):
    """An inner loop: a model between commanded body rates and attitude."""

    def fly(
        self, planner: Planner, start: Quaternion, target: Target, *, seconds: float, rate_hz: float
    ) -> LoopFlight:
        """Fly from rest to a target; see `InnerLoop.fly`."""
        ...


def fly(planner: LawPlanner, step: Step) -> Response:
    """Fly a step with an ideal rate loop: body rates equal the commanded ones (section 4)."""
    starts = [attitude(step.start, heading) for heading in step.headings]
    targets = [(*step.target, heading, 0.0) for heading in step.headings]
    history = batch.simulate(
        planner, np.array(starts).T, np.array(targets).T, 1.0 / step.rate_hz, step.samples
    )
    return Response(step, batch.coefficients(history.q), history.rates)


def fly_loop(planner: Planner, step: Step, loop: Loop) -> Response:
    """Fly a step with the inner loop `loop`."""
    flights = []
    for heading in step.headings:
        start = attitude(step.start, heading)
        planner.reset(start)
        target = Target(*step.target, heading)
        flights.append(loop.fly(planner, start, target, seconds=step.seconds, rate_hz=step.rate_hz))
    return Response(
        step,
        batch.coefficients(np.stack([flight.q for flight in flights], axis=-1)),
        np.stack([flight.commanded_rates for flight in flights], axis=-1),
    )
