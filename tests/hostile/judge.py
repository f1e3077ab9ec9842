"""The rules that hold for every flight, judged by what the companion sent and the vehicle did."""

from math import hypot, isfinite, radians

from tests.hostile import personality as kinds
from tests.hostile.autopilot import LONGEST_S, STEP_S

_FRESH_S = 0.1 + STEP_S
_TOLD_AND_ANSWERED_S = 2 * STEP_S
_QUESTIONS = {kinds.SET_MESSAGE_INTERVAL, kinds.REQUEST_MESSAGE, kinds.RUN_PREARM_CHECKS}
_HARMLESS = {"HEARTBEAT", "TIMESYNC", "SYSTEM_TIME", "PARAM_REQUEST_READ", "STATUSTEXT", "EVENT"}
_OURS = {"COMMAND_LONG", "SET_ATTITUDE_TARGET", *_HARMLESS}
_KEPT_BY_NAN = {kinds.TAKEOFF, kinds.LAND}
"""Commands in which NaN means "as it is"."""
_IMPACT_M_S = 3.0


def setpoints(flown):
    """What steers, in order."""
    return [sent for sent in flown.autopilot.sent if sent.name == "SET_ATTITUDE_TARGET"]


def commands(flown, *numbers):
    """Commands that ask the vehicle to do something; `numbers` chooses among them."""
    long = [sent for sent in flown.autopilot.sent if sent.name == "COMMAND_LONG"]
    asked = [sent for sent in long if sent.message.command not in _QUESTIONS]
    return [sent for sent in asked if not numbers or sent.message.command in numbers]


def judge(flown, *, ages_hidden=False, clock_restarts=False, may_fall=False):
    """Hold one flight to all rules.

    Args:
        flown: it.
        ages_hidden: nothing tells that samples are old, so answering them is no fault.
        clock_restarts: a stamp may come, and so be answered, twice.
        may_fall: it was disarmed in the air, not by us.
    """
    _ended_in_words(flown)
    _numbers(flown)
    _answers_to_fresh_samples(flown, ages_hidden, clock_restarts)
    _never_idle_in_flight(flown)
    _arming(flown)
    _nothing_after_taken(flown)
    assert may_fall or flown.autopilot.vehicle.body.impact < _IMPACT_M_S, "it crashed"


def _ended_in_words(flown):
    said = f"{flown.result}; {flown.events}"
    assert flown.result
    assert "internal error" not in said, said
    assert "Traceback" not in said, said
    assert flown.autopilot.vehicle.t < LONGEST_S, "it never ended"


def _numbers(flown):
    """Nothing that is not finite, nothing beyond a limit, no way of steering but ours."""
    limits = flown.config.limits
    for sent in flown.autopilot.sent:
        assert sent.name in _OURS, f"{sent.name} was sent"
        kept = sent.name == "COMMAND_LONG" and sent.message.command in _KEPT_BY_NAN
        for name, value in sent.message.to_dict().items():
            if isinstance(value, float) and not (kept and name in ("param4", "param5", "param6")):
                assert isfinite(value), f"{sent.name} {name} {value} at {sent.t:.2f} s"
    for sent in setpoints(flown):
        message = sent.message
        tilt_rate = hypot(message.body_roll_rate, message.body_pitch_rate)
        assert tilt_rate <= radians(limits.max_tilt_rate_deg_s) + 1e-5, sent
        assert abs(message.body_yaw_rate) <= radians(limits.max_yaw_rate_deg_s) + 1e-5, sent
        assert message.type_mask == 128, sent
        assert 0.0 <= message.thrust <= limits.max_thrust + 1e-6, sent


def _answers_to_fresh_samples(flown, ages_hidden, clock_restarts):
    """Each setpoint answers a sample of its own step, once, and one that is not old."""
    samples = flown.autopilot.telemetry.samples
    arrived = {(round(1000 * t), stamp): t - at for t, stamp, at in samples}
    answered = set()
    for sent in setpoints(flown):
        stamp = sent.message.time_boot_ms
        age = arrived.get((round(1000 * sent.t), stamp))
        assert age is not None, f"a setpoint at {sent.t:.2f} s answers no sample of its step"
        assert clock_restarts or stamp not in answered, f"sample {stamp} was answered twice"
        assert ages_hidden or age <= _FRESH_S, f"a sample {1e3 * age:.0f} ms old was answered"
        answered.add((sent.t, stamp) if clock_restarts else stamp)


def _never_idle_in_flight(flown):
    """Once a take-off was commanded, or in the air, no thrust below the least one."""
    took_off = min((sent.t for sent in commands(flown, kinds.TAKEOFF)), default=LONGEST_S)
    least = flown.config.limits.min_thrust - 1e-6
    for sent in setpoints(flown):
        flies = sent.in_air or sent.t > took_off
        assert not flies or sent.message.thrust >= least, (
            f"thrust {sent.message.thrust} at {sent.t:.2f} s"
        )


def _arming(flown):
    """No arming without being told to, and none after the vehicle was armed once."""
    armings = [sent for sent in commands(flown, kinds.ARM) if sent.message.param1 > 0.5]
    assert flown.config.flight.arm or not armings, "it armed, with flight.arm false"
    armed = flown.autopilot.marks.get("armed")
    assert all(armed is None or sent.t < armed for sent in armings), "it armed a second time"


def _nothing_after_taken(flown):
    """From when a pilot's or a failsafe's mode was told, no setpoint and no command.

    Before a take-off was commanded PX4 may get idle setpoints in any mode: they move nothing.
    """
    taken = flown.autopilot.marks.get("taken")
    if taken is None:
        return
    told = [t for t, _, _ in flown.autopilot.telemetry.told if t > taken]
    from_then = min(told, default=taken) + _TOLD_AND_ANSWERED_S
    idle_until = min((sent.t for sent in commands(flown, kinds.TAKEOFF)), default=LONGEST_S)
    steering = [each for each in setpoints(flown) if each.message.thrust or each.t > idle_until]
    late = [sent for sent in (*steering, *commands(flown)) if sent.t > from_then]
    found = [(sent.name, round(sent.t, 2)) for sent in late[:3]]
    assert not late, f"sent after another's mode was told at {from_then:.2f} s: {found}"
