"""What a program sees of the vehicle."""

from typing import NamedTuple

from companion.attitude import BodyRates, Quaternion
from companion.attitude.representation import heading
from companion.flight.context import FlightContext
from companion.guidance.reference import Vector


class State(NamedTuple):
    """The vehicle at one instant.

    Positions and headings are in the estimator's frame, without the jumps of its resets: a
    reference in the same frame never jumps.

    Attributes:
        time: s on the clock of the event loop.
        position_ned: m.
        velocity_ned: m/s.
        q: attitude, body to world, w first.
        body_rates: rad/s, about body x, y, z (FRD).
        heading: tilt-yaw heading, rad.
        height: above home, m; None where the autopilot has not told it.
    """

    time: float
    position_ned: Vector
    velocity_ned: Vector
    q: Quaternion
    body_rates: BodyRates
    heading: float
    height: float | None


def state_of(context: FlightContext, now: float) -> State:
    """The newest state; `now` in s on our clock.

    Raises:
        RuntimeError: no position or no attitude has come yet.
    """
    sample = context.loop.resets.newest
    if sample is None:
        raise RuntimeError("no attitude has come from the vehicle yet")
    motion = context.guidance_loop.motion_now()
    q = context.guidance_loop.attitude()
    return State(
        now,
        motion.position_ned,
        motion.velocity_ned,
        q,
        sample.body_rates,
        heading(q),
        context.link.state.height,
    )
