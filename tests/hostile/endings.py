"""What a scenario demands of its flight beyond the rules of `judge`; each takes the `Flown`."""

import re

from tests.hostile import personality as kinds
from tests.hostile.judge import commands, setpoints


def ok(flown):
    """The flight is flown to its end and landed."""
    assert flown.result == "ok", flown.events
    on_the_ground(flown)


def on_the_ground(flown):
    vehicle = flown.autopilot.vehicle
    assert (vehicle.armed, vehicle.body.in_air) == (False, False), flown.events


def never_took_off(flown):
    """No take-off was commanded, and none began."""
    assert not commands(flown, kinds.TAKEOFF), f"it took off: {flown.events}"
    assert "in air" not in flown.autopilot.marks
    assert flown.result != "ok"


def never_armed(flown):
    """No arming was asked for, and so no take-off."""
    assert not [sent for sent in commands(flown, kinds.ARM) if sent.message.param1 > 0.5]
    never_took_off(flown)


def never_took_over(flown):
    """Our rates were never obeyed; the flight failed."""
    assert "in control" not in flown.autopilot.marks, f"it took over: {flown.events}"
    assert not [sent for sent in setpoints(flown) if sent.mode == "RATES"]
    assert flown.result != "ok"


def failed(flown):
    """The flight failed, in words."""
    assert flown.result != "ok"


def left_alone(flown):
    """After what the script did last, no mode and no landing is commanded; the flight failed."""
    since = flown.autopilot.acted[-1]
    late = [sent for sent in commands(flown, kinds.LAND, kinds.SET_MODE) if sent.t >= since]
    assert not late, f"{late[0]}: {flown.events}"
    failed(flown)


def says(pattern):
    """Result or events say so."""

    def demand(flown):
        said = f"{flown.result}; {flown.events}"
        assert re.search(pattern, said, re.IGNORECASE), said

    return demand


def never_says(pattern):
    """Neither result nor events say so."""

    def demand(flown):
        said = f"{flown.result}; {flown.events}"
        assert not re.search(pattern, said, re.IGNORECASE), said

    return demand


def gives_back(within):
    """HOLD or LAND is commanded within so many seconds of what the script did last."""

    def demand(flown):
        _asked(flown, {"HOLD", "LAND"}, within)
        failed(flown)

    return demand


def lands(within):
    """LAND is commanded in time, and the vehicle stands disarmed in the end."""

    def demand(flown):
        _asked(flown, {"LAND"}, within)
        failed(flown)
        on_the_ground(flown)

    return demand


def stops_within(seconds):
    """No setpoint leaves later than that after what the script did last; the flight failed."""

    def demand(flown):
        until = flown.autopilot.acted[-1] + seconds
        late = [sent.t for sent in setpoints(flown) if sent.t > until]
        assert not late, f"setpoints until {late[-1]:.2f} s, {until:.2f} s was the latest"
        failed(flown)

    return demand


def _asked(flown, modes, within):
    since = flown.autopilot.acted[-1]
    mode_asked = flown.autopilot.vehicle.kind.mode_asked
    asked = [
        sent.t
        for sent in commands(flown, kinds.LAND, kinds.SET_MODE)
        if sent.t >= since - 1e-6
        and (sent.message.command == kinds.LAND or mode_asked(sent.message) in modes)
        and (sent.message.command == kinds.SET_MODE or "LAND" in modes)
    ]
    assert asked, f"{modes} was never asked for: {flown.result}; {flown.events}"
    assert asked[0] - since <= within, f"asked only after {asked[0] - since:.2f} s"
