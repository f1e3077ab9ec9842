"""The table of monitors: check, action, and how long a breach must last.

To add a monitor, write its check beside the others (`*_breaches.py`), its row here, and what to do
in `companion.recording.what_to_do`.
"""

from dataclasses import replace
from math import radians

from companion.config import Config
from companion.guidance.fence import Fence
from companion.safety import autopilot_breaches, link_breaches, motion_breaches
from companion.safety.actions import Action, StreamEffect
from companion.safety.monitor import Monitor
from companion.safety.plugin_monitors import plugin_monitors

_BACKLOG_TIME = 0.2
"""Time after a stall in which queued telemetry is read, s; until then telemetry looks old."""
_MAX_GAPS = 2
"""Largest number of gaps in the setpoints within 5 s."""
_MAX_UNANSWERED = 7
"""Largest number of TIMESYNC probes in a row that the vehicle may leave unanswered; they are sent
every 0.1 s. If single probes are lost at random, eight in a row are lost once in 50 s at a loss of
50 %, in 36 min at 30 %, in 13 h at 20 %."""
_MAX_FOREIGN_REPORTS = 2
"""Largest number of foreign setpoints that the autopilot may report within 5 s."""
_LARGEST_HEADING_DRIFT = radians(30.0)
"""Largest gradual change of the heading in 20 s that the body rates do not explain, rad. From 45°
on position control swings, from 60° on it diverges; real autopilots in simulation drift by up to
2.8°."""
_LARGEST_HEIGHT_CONTRADICTION = 1.5
"""Largest change of the height in 3 s that the vertical speed does not explain, m. In 153 flights
of real autopilots in simulation it was at most 0.35 m. With a barometer that jumped by 6 m it was
3.6 m: ArduPilot's vehicle sank to the ground at 1 m/s."""
_ESTIMATE_DELAY = 0.08
"""Delay of the estimated horizontal motion behind the true motion, s. Measured on accelerating
mock vehicles: ArduPilot's position 0.055 s and velocity up to 0.09 s, PX4's 0.02 s."""
_RELEASE, _HAND_BACK, _HOLD, _LAND = Action.RELEASE, Action.HAND_BACK, Action.HOLD, Action.LAND


def monitors(config: Config) -> tuple[Monitor, ...]:
    """The monitors of a flight; among equally severe breaches the first row decides.

    No monitor detects a takeover by the pilot or an unknown mode: `companion.flight.watch` detects
    both, and releases control.

    Raises:
        ConfigError: a monitor of another package cannot be used; see `plugin_monitors`.
    """
    return (
        *_fixed_monitors(config),
        *_autopilot_monitors(config),
        *_motion_monitors(config),
        *_link_monitors(config),
        *plugin_monitors(config),
    )


def _fixed_monitors(config: Config) -> tuple[Monitor, ...]:
    """Monitors of silence, frozen data, clock, arming, landing, failsafe; all actions are fixed."""
    limit = config.deadman.silence_limit
    unheard = link_breaches.silence(limit, vehicle_heard=False)
    silence = link_breaches.silence(
        limit, vehicle_heard=True, planner=config.planner.name, guidance=config.guidance.kind
    )
    return (
        Monitor("unheard", unheard, Action.LISTEN, stream=StreamEffect.STOPS_AT_ONCE),
        Monitor("silence", silence, _HAND_BACK, stream=StreamEffect.STOPS_AT_ONCE),
        Monitor(
            "frozen",
            link_breaches.frozen_telemetry,
            _HAND_BACK,
            stream=StreamEffect.ENDS_WITH_ZERO_RATES,
        ),
        Monitor(
            "clock", link_breaches.clock_changed, _HAND_BACK, stream=StreamEffect.STOPS_AT_ONCE
        ),
        Monitor("disarmed", autopilot_breaches.disarmed, _RELEASE),
        Monitor("landed", autopilot_breaches.landed, _LAND),
        # This is for failsafes that do not change the mode: a change of mode is a takeover.
        Monitor("failsafe", autopilot_breaches.failsafe, _HAND_BACK),
    )


def _autopilot_monitors(config: Config) -> tuple[Monitor, ...]:
    """Monitors of battery, GPS and estimator."""
    safety = config.safety
    resets = autopilot_breaches.too_many_estimator_resets(
        safety.max_resets, safety.max_reset_m, safety.max_reset_angle
    )
    drift = autopilot_breaches.heading_drift(_LARGEST_HEADING_DRIFT)
    height = autopilot_breaches.height_contradiction(_LARGEST_HEIGHT_CONTRADICTION)
    battery = autopilot_breaches.battery(config.limits.min_battery)
    position = Action(safety.position_action)
    return (
        Monitor(
            "battery",
            battery,
            Action(safety.battery_action),
            raise_after=_BACKLOG_TIME,
            clear_after=5.0,
        ),
        Monitor("gps", autopilot_breaches.gps, position, raise_after=_BACKLOG_TIME),
        Monitor("estimator", autopilot_breaches.estimator_flags, position, raise_after=0.5),
        Monitor("reset", autopilot_breaches.any_estimator_reset, Action.WARN, raise_after=0.1),
        Monitor("resets", resets, Action(safety.reset_action)),
        Monitor("heading", drift, Action(safety.reset_action)),
        Monitor("height", height, position, raise_after=0.1),
    )


def _motion_monitors(config: Config) -> tuple[Monitor, ...]:
    """Monitors of flight envelope, fence, tracking error and thrust."""
    safety, limits, fence = config.safety, config.limits, fence_of(config)
    tilt = motion_breaches.tilt(limits.max_tilt + safety.tilt_margin)
    body_rate = motion_breaches.body_rate(safety.max_body_rate)
    outside, braking = motion_breaches.outside(fence), motion_breaches.braking(fence)
    speed = motion_breaches.speed(safety.max_speed_m_s)
    tracking = motion_breaches.tracking(safety.max_tracking_error_m)
    thrust = motion_breaches.thrust(limits.min_thrust, limits.max_thrust)
    envelope_action, fence_action = Action(safety.envelope_action), Action(safety.fence_action)
    return (
        Monitor("tilt", tilt, envelope_action, raise_after=0.3),
        Monitor("body rate", body_rate, envelope_action, raise_after=0.2),
        Monitor("fence", outside, fence_action),
        Monitor("braking", braking, _HOLD, raise_after=0.04, action_after_hold=fence_action),
        Monitor("speed", speed, Action(safety.speed_action), raise_after=0.3),
        Monitor("tracking", tracking, Action(safety.tracking_action), raise_after=1.0),
        Monitor("thrust", thrust, Action(safety.thrust_action), raise_after=2.0),
    )


def _link_monitors(config: Config) -> tuple[Monitor, ...]:
    """Monitors of the link and of this computer."""
    safety = config.safety
    link, computer = Action(safety.link_action), Action(safety.computer_action)
    round_trip = link_breaches.round_trip(safety.max_round_trip)
    answers = link_breaches.answer_rate(config.link.min_attitude_rate_hz)
    positions = link_breaches.position_rate(config.link.min_position_rate_hz)
    late = link_breaches.late_setpoints(config.deadman.telemetry_stale)
    foreign = link_breaches.foreign_setpoints(_MAX_FOREIGN_REPORTS)
    lost = link_breaches.lost_setpoints(_MAX_UNANSWERED)
    return (
        # The vehicle keeps turning at the last rate until the next setpoint. A low rate of
        # setpoints causes errors of a few degrees; a gap of 0.4 s exceeds the whole tilt limit.
        Monitor("answer gaps", link_breaches.gaps(_MAX_GAPS), _HAND_BACK),
        Monitor("answer rate", answers, _HAND_BACK, raise_after=1.0),
        Monitor("position rate", positions, _HAND_BACK, raise_after=1.0),
        Monitor("late setpoints", late, _HAND_BACK, stream=StreamEffect.ENDS_WITH_ZERO_RATES),
        Monitor("lost setpoints", lost, _HAND_BACK, stream=StreamEffect.ENDS_WITH_ZERO_RATES),
        # In a mode of the pilot the autopilot reports its own setpoints; `raise_after` leaves time
        # for the requested heartbeat, which contains the mode.
        Monitor("foreign setpoints", foreign, _HAND_BACK, raise_after=0.3),
        # `raise_after` lets a change of the mode, or the row above, end control first.
        Monitor("rare setpoint", link_breaches.rare_foreign_setpoint, Action.WARN, raise_after=1.0),
        Monitor(
            "link loss", link_breaches.loss(safety.max_loss), link, raise_after=2.0, clear_after=2.0
        ),
        Monitor("round trip", round_trip, link, raise_after=5.0, clear_after=5.0),
        # `raise_after` exceeds the averaging window of 1 s: one stall is no breach.
        Monitor("deadlines", link_breaches.deadlines(safety.max_missed), computer, raise_after=1.5),
        Monitor(
            "starvation", link_breaches.starvation(safety.max_starved), computer, raise_after=1.5
        ),
    )


def fence_of(config: Config) -> Fence:
    """The fence of `limits` and `safety`, with `_ESTIMATE_DELAY` as the delay of the estimate."""
    return replace(config.fence, estimate_delay=_ESTIMATE_DELAY)
