"""The vocabulary of scripts: what a vehicle, its pilot or a stranger does when its time comes.

Each function returns an action, which takes the `HostileAutopilot`.
"""

from math import inf


def says(name, seconds=inf, **fields):
    """Tell other fields in a message."""
    return tells(name, fields, seconds)


def tells(name, change, seconds=inf):
    """Tell what `change` makes of a message's fields: a dict, a function, several or None."""

    def act(autopilot):
        until = autopilot.vehicle.t + seconds - 1e-6
        autopilot.telemetry.lies.append((name, change, until))

    return act


def stops(*names, seconds=inf):
    """Send those messages no more."""
    return together(*(tells(name, lambda _: None, seconds) for name in names))


def silent(seconds):
    """Say nothing at all."""

    def act(autopilot):
        autopilot.silent_until = autopilot.vehicle.t + seconds

    return act


def late(seconds, *names):
    """Keep those messages back for so long, or all that are streamed.

    Args:
        seconds: a number, or a function of vehicle time in s.
        names: of messages.
    """

    def act(autopilot):
        autopilot.telemetry.delays |= dict.fromkeys(names or ("*",), seconds)

    return act


def streams(name, hz, fixed=False):
    """Send at that rate; `fixed`: SET_MESSAGE_INTERVAL does not change it any more."""

    def act(autopilot):
        autopilot.telemetry.rates[name] = hz
        autopilot.telemetry.fixed |= {name} if fixed else set()

    return act


def clock(stamped):
    """Stamp by `stamped`: boot time so far in s → what is stamped, s."""

    def act(autopilot):
        autopilot.telemetry.clock = stamped

    return act


def clock_from_now(stamped):
    """Stamp by `stamped`: (now, time s since now) → what is stamped, s."""

    def act(autopilot):
        began = autopilot.vehicle.t
        autopilot.telemetry.clock = lambda t: stamped(began, t - began)

    return act


def timesync(answer):
    """Answer TIMESYNC by this clock: true time in s → s; None: not at all."""
    return sets("autopilot", timesync=answer)


def sets(part="vehicle", **values):
    """Set attributes of the vehicle, its telemetry, or the autopilot."""

    def act(autopilot):
        for name, value in values.items():
            setattr(_part(autopilot, part), name, value)

    return act


def _part(autopilot, name):
    return {"autopilot": autopilot, "body": autopilot.vehicle.body}.get(
        name, getattr(autopilot, name, None)
    )


def together(*actions):
    """Do all of them."""

    def act(autopilot):
        for action in actions:
            action(autopilot)

    return act


def acks(command, how):
    """Answer a command as `how` says, a key of `autopilot.ACKS`."""
    return lambda autopilot: autopilot.acks.__setitem__(command, how)


def switches(mode):
    """A pilot who is ours to obey switches to a mode in which the flight may go on."""
    return lambda autopilot: autopilot.vehicle.enter(mode)


def takes(mode="PILOT"):
    """Pilot or failsafe take the vehicle: from when that is told nothing may be sent."""

    def act(autopilot):
        autopilot.mark("taken")
        autopilot.vehicle.enter(mode)

    return act


def fails_safe(mode):
    """A failsafe of the autopilot's, told by MAV_STATE_CRITICAL."""
    return together(sets(critical=True), takes(mode))


def arms(autopilot):
    """The pilot arms."""
    autopilot.vehicle.arm()


def disarms(autopilot):
    """The motors are stopped, not by us."""
    autopilot.vehicle.arm(False)


def parameter(name, value):
    """Somebody sets a parameter; the autopilot tells everybody."""

    def act(autopilot):
        autopilot.parameters[name] = value
        autopilot.tell_parameter(name)

    return act


def boots_again(silence=4.5, uid=7, port=False):
    """The vehicle goes, and one with the same ids comes, with its boot time near 0."""

    def act(autopilot):
        autopilot.silent_until = back = autopilot.vehicle.t + silence
        autopilot.telemetry.clock, autopilot.uid = (lambda t: t - back), uid
        autopilot.timesync = autopilot.telemetry.clock
        autopilot.telemetry.rates = dict(autopilot.vehicle.kind.default_rates)
        if port:
            autopilot.wire.move_to_another_port()

    return act


def restarts(silence):
    """The autopilot restarts, as after a dip of its supply: disarmed, in its first mode."""
    return together(boots_again(silence), disarms, switches("STABILIZE"))


ON_GROUND, IN_AIR = {"landed_state": 1}, {"landed_state": 2}


def flaps(autopilot):
    """EXTENDED_SYS_STATE says ON_GROUND in every other message."""
    told = []

    def change(fields):
        told.append(None)
        return {**fields, **ON_GROUND} if len(told) % 2 else fields

    tells("EXTENDED_SYS_STATE", change)(autopilot)


GPS_GONE = sets("telemetry", fix_type=0)
ESTIMATOR_GONE = sets("telemetry", flags=0)
BATTERY_EMPTY = sets("telemetry", battery=0.03)
CRITICAL = sets(critical=True)
PREARM_BAD = sets(healthy=False)
SLOW_ATTITUDE = streams("ATTITUDE_QUATERNION", 12.0, fixed=True)
POSITION_GONE = stops("LOCAL_POSITION_NED")


def takes_off_by_itself(autopilot):
    """It arms and climbs, commanded by nobody we know."""
    autopilot.vehicle.arm()
    autopilot.vehicle.take_off(2.0)
