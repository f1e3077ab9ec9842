"""Whether a trajectory can be flown within limits, and how much slower if not."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import pi
from typing import NamedTuple

import numpy as np

from companion.drag import NO_DRAG, Drag
from companion.guidance.trajectory.demand import Floats, Motion, demand, sampled
from companion.guidance.trajectory.derived import Slowed
from companion.guidance.trajectory.sample import Trajectory, TrajectoryError, computable

_ROUNDING = 1e-9
"""Share of a limit by which it may be exceeded: the fastest place may lie exactly on it."""

_SLOWEST = 64.0
"""The largest factor tried."""

_PRECISION = 1e-3
"""Of the factor, as a share of it."""

_DEGREES = 180.0 / pi

SLOWER = "fly it more slowly (--slow-down finds how much), or change the limit"
"""What to do where the motion breaks a limit."""


class Violation(NamedTuple):
    """A limit that a trajectory breaks; its text is for the user.

    Attributes:
        limit: the key of the configuration that sets it.
        begins: when it is first broken, s.
        time: when it is broken most, s.
        text: all of this in words.
        remedy: what to do about it, as the end of a sentence.
        slowing_helps: whether the limit is kept if the trajectory is flown slowly enough.
    """

    limit: str
    begins: float
    time: float
    text: str
    remedy: str = SLOWER
    slowing_helps: bool = True

    def __str__(self) -> str:
        return self.text


@dataclass(frozen=True, slots=True)
class Envelope:
    """Limits of a trajectory; `None` is no limit. Lengths count from the start.

    Attributes:
        max_tilt: of the thrust from the vertical, rad.
        max_tilt_rate: roll-pitch rate, rad/s.
        max_yaw_rate: of the heading, rad/s.
        min_thrust: specific, m/s².
        max_thrust: specific, m/s².
        max_climb: upward speed, m/s.
        max_descent: downward speed, m/s.
        max_speed: m/s.
        fence: checks the positions, and where the vehicle would stop.
        drag: against still air.
        gravity: m/s².
    """

    max_tilt: float | None = None
    max_tilt_rate: float | None = None
    max_yaw_rate: float | None = None
    min_thrust: float | None = None
    max_thrust: float | None = None
    max_climb: float | None = None
    max_descent: float | None = None
    max_speed: float | None = None
    fence: Callable[[Motion], Violation | None] | None = None
    drag: Drag = NO_DRAG
    gravity: float = 9.80665


class _Need(NamedTuple):
    """What a motion needs of one limited quantity.

    Attributes:
        limit: its key.
        allowed: None for no limit.
        needed: (m,), in the unit of `allowed`.
        shown_in: how many units shown make one of these.
        what: the shown unit and the quantity.
        least: whether the limit is a lower one.
    """

    limit: str
    allowed: float | None
    needed: Floats
    what: str
    shown_in: float = 1.0
    least: bool = False


def violations(trajectory: Trajectory, envelope: Envelope) -> tuple[Violation, ...]:
    """All limits that a trajectory breaks, in order of time; empty if it can be flown."""
    with computable():
        return _broken(sampled(trajectory), envelope)


def judge(motion: Motion, envelope: Envelope) -> tuple[Violation, ...]:
    """All limits that a motion breaks, in the order of time."""
    with computable():
        return _broken(motion, envelope)


def slow_down(trajectory: Trajectory, envelope: Envelope) -> tuple[Trajectory, float]:
    """The trajectory, stretched in time by the smallest factor that keeps all limits.

    Returns:
        The trajectory itself if it can be flown as it is, else the stretched one; and the factor.

    Raises:
        TrajectoryError: however slowly it is flown, it breaks a limit.
    """
    with computable():
        return _slowed_down(trajectory, sampled(trajectory), envelope)


def _slowed_down(
    trajectory: Trajectory, motion: Motion, envelope: Envelope
) -> tuple[Trajectory, float]:
    broken = _broken(motion, envelope)
    if not broken:
        return trajectory, 1.0
    for one in broken:
        if not one.slowing_helps:
            raise TrajectoryError(f"{trajectory.name}: {one}; {one.remedy}")
    too_fast, slow = 1.0, 2.0
    while found := _broken(motion.slowed(slow), envelope):
        too_fast, slow = slow, 2.0 * slow
        if slow > _SLOWEST:
            raise TrajectoryError(
                f"{trajectory.name}: however slowly it is flown, {found[0]}; {found[0].remedy}"
            )
    while slow - too_fast > _PRECISION * too_fast:
        middle = 0.5 * (too_fast + slow)
        if _broken(motion.slowed(middle), envelope):
            too_fast = middle
        else:
            slow = middle
    return Slowed(trajectory, slow), slow


def _broken(motion: Motion, envelope: Envelope) -> tuple[Violation, ...]:
    found = [_violation(motion.times, need) for need in _needs(motion, envelope)]
    if envelope.fence is not None:
        found.append(envelope.fence(motion))
    return tuple(sorted((one for one in found if one), key=lambda one: one.begins))


def _needs(motion: Motion, envelope: Envelope) -> Iterator[_Need]:
    """What the motion needs of everything that the envelope limits."""
    e, climb = envelope, -motion.velocity[:, 2]
    rotors = demand(motion, e.drag, e.gravity)
    turn = np.abs(motion.heading_rate)
    speed = np.linalg.norm(motion.velocity, axis=1)
    yield _Need("limits.max_tilt_deg", e.max_tilt, rotors.tilt, "° of tilt", _DEGREES)
    turning = rotors.tilt_rate
    spin = "°/s of roll and pitch"
    yield _Need("limits.max_tilt_rate_deg_s", e.max_tilt_rate, turning, spin, _DEGREES)
    yield _Need("limits.max_yaw_rate_deg_s", e.max_yaw_rate, turn, "°/s of yaw", _DEGREES)
    yield _Need("limits.min_thrust", e.min_thrust, rotors.thrust, " m/s² of thrust", least=True)
    yield _Need("limits.max_thrust", e.max_thrust, rotors.thrust, " m/s² of thrust")
    yield _Need("limits.max_climb_m_s", e.max_climb, climb, " m/s of climb")
    yield _Need("limits.max_descent_m_s", e.max_descent, -climb, " m/s of descent")
    yield _Need("safety.max_speed_m_s", e.max_speed, speed, " m/s of speed")


def _violation(times: Floats, need: _Need) -> Violation | None:
    if need.allowed is None:
        return None
    excess = need.needed - need.allowed
    if need.least:
        excess = -excess
    broken = excess > _ROUNDING * max(abs(need.allowed), 1.0)
    if not broken.any():
        return None
    begins, time = float(times[np.argmax(broken)]), float(times[np.argmax(excess)])
    needed = float(need.needed[np.argmax(excess)]) * need.shown_in
    text = (
        f"at {time:.2f} s it needs {needed:.4g}{need.what}, {need.limit} allows "
        f"{'no less than ' if need.least else ''}{need.allowed * need.shown_in:.4g}"
    )
    if begins < time:
        text += f" (broken from {begins:.2f} s on)"
    return Violation(need.limit, begins, time, text)
