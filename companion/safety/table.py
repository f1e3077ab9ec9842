"""The one table of what is watched, how long a breach must last, and what it leads to."""

from companion.config import Config
from companion.guidance.fence import Fence
from companion.safety import authority, envelope, estimate, resources
from companion.safety.fence import braking, outside
from companion.safety.monitor import Action, Monitor
from companion.safety.silence import clock_changed, silence

_READ = 0.2
"""After a pause of ours what came meanwhile is read within so long, s; until then it looks old."""
_GAPS = 2
"""In the answers, within 5 s: a link may stumble, but not all the time."""
_RELEASE, _HAND_BACK, _HOLD, _LAND = Action.RELEASE, Action.HAND_BACK, Action.HOLD, Action.LAND


def monitors(config: Config) -> tuple[Monitor, ...]:
    """The monitors of a flight, the graver reasons first.

    The pilot's takeover and a mode that is not known any more are judged beside them, in every
    phase in which a mode is ours (`companion.flight.watch`): both let go.
    """
    return (*_authority(config), *_vehicle(config), *_course(config), *_means(config))


def _authority(config: Config) -> tuple[Monitor, ...]:
    """What cannot be set otherwise."""
    limit = config.deadman.silence_limit
    unheard, still = silence(limit, heard=False), silence(limit, heard=True)
    return (
        Monitor("unheard", unheard, _RELEASE, mutes=True),
        Monitor("silence", still, _HAND_BACK, mutes=True),
        Monitor("clock", clock_changed, _HAND_BACK, mutes=True),
        Monitor("disarmed", authority.disarmed, _RELEASE),
        Monitor("landed", authority.landed, _LAND),
        # Where it acts, the mode is not ours any more, and that is seen first. ArduPilot tells of
        # one without an action, too, in which nobody would fly.
        Monitor("failsafe", authority.failsafe, _HAND_BACK),
    )


def _vehicle(config: Config) -> tuple[Monitor, ...]:
    """Its battery, and what it knows of itself."""
    safety = config.safety
    resets = estimate.resets(safety.max_resets, safety.max_reset_m, safety.max_reset_angle)
    battery = resources.battery(config.limits.min_battery)
    position = Action(safety.position_action)
    return (
        Monitor("battery", battery, Action(safety.battery_action), lasts=_READ, calm=5.0),
        Monitor("gps", estimate.gps, position, lasts=_READ),
        Monitor("estimator", estimate.flags, position, lasts=0.5),
        Monitor("reset", estimate.reset, Action.WARN, lasts=0.1),
        Monitor("resets", resets, Action(safety.reset_action)),
    )


def _course(config: Config) -> tuple[Monitor, ...]:
    """Where it is and how it moves."""
    safety, limits, fence = config.safety, config.limits, fence_of(config)
    lean = limits.max_tilt + safety.tilt_margin
    spin = safety.max_body_rate
    off, fast = envelope.tracking(safety.max_tracking_error_m), envelope.speed(safety.max_speed_m_s)
    saturated = envelope.thrust(limits.min_thrust, limits.max_thrust)
    envelope_action, out = Action(safety.envelope_action), Action(safety.fence_action)
    return (
        Monitor("tilt", envelope.tilt(lean), envelope_action, lasts=0.3),
        Monitor("body rate", envelope.body_rate(spin), envelope_action, lasts=0.2),
        Monitor("fence", outside(fence), out),
        Monitor("braking", braking(fence), _HOLD, lasts=0.04, then=out),
        Monitor("speed", fast, Action(safety.speed_action), lasts=0.3),
        Monitor("tracking", off, Action(safety.tracking_action), lasts=1.0),
        Monitor("thrust", saturated, Action(safety.thrust_action), lasts=2.0),
    )


def _means(config: Config) -> tuple[Monitor, ...]:
    """The link and this computer."""
    safety = config.safety
    link, computer = Action(safety.link_action), Action(safety.computer_action)
    trip = resources.round_trip(safety.max_round_trip)
    answers = resources.answer_rate(config.link.min_attitude_rate_hz)
    positions = resources.position_rate(config.link.min_position_rate_hz)
    return (
        # A rate that is held turns the vehicle on: at limits.max_tilt_rate_deg_s by a few degrees
        # between answers that are too rare, which the next one corrects; but in a gap of 0.4 s by
        # as much as it may tilt. So rare answers may last for a second, and gaps not at all.
        Monitor("answer gaps", resources.gaps(_GAPS), _HAND_BACK),
        Monitor("answer rate", answers, _HAND_BACK, lasts=1.0),
        Monitor("position rate", positions, _HAND_BACK, lasts=1.0),
        Monitor("link loss", resources.loss(safety.max_loss), link, lasts=2.0, calm=2.0),
        Monitor("round trip", trip, link, lasts=5.0, calm=5.0),
        # Longer than the second that is looked at: one stall of the computer is no breach.
        Monitor("deadlines", resources.deadlines(safety.max_missed), computer, lasts=1.5),
        Monitor("starvation", resources.starvation(safety.max_starved), computer, lasts=1.5),
    )


def fence_of(config: Config) -> Fence:
    """The fence that `limits` and `safety` describe."""
    limits, safety = config.limits, config.safety
    return Fence(
        limits.fence_radius_m,
        limits.fence_ceiling_m,
        limits.fence_floor_m,
        safety.fence_polygon_m,
        safety.fence_polygon_deg,
        safety.braking_m_s2,
        safety.reaction_s,
    )
