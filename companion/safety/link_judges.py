"""Judges of the data flow: silence, the vehicle's clock, the link, and this computer.

The docstring of each judge states its breach.
"""

from companion.control.loop_record import Unanswered
from companion.safety.monitor import Judge, minimum_with_hysteresis, with_hysteresis
from companion.safety.snapshot import UNHEARD_S, Control, Snapshot

_STALL_SHARE = 0.5
"""If this program did not run for more than this share of the time since its last setpoint, this
computer is named as the cause."""


def silence(limit: float, *, heard: bool) -> Judge:
    """No setpoint was sent for longer than `limit` s.

    `heard`: True: judge only while frames come from the vehicle. False: only while none come.
    """

    def judge(snapshot: Snapshot, _: bool) -> str | None:
        now, control = snapshot.now, snapshot.control
        if (
            now - control.last_answer <= limit
            or (now - control.last_heard < UNHEARD_S) is not heard
        ):
            return None
        return _silence_cause(now, control, limit)

    return judge


def _silence_cause(now: float, control: Control, limit: float) -> str:
    if control.stalled > _STALL_SHARE * (now - control.last_answer):
        # Data that came during the stall were read late, so they only seem old.
        still = control.stalled
        return f"this program did not run for {still:.1f} s (computer overloaded or suspended)"
    if now - control.last_sample > limit:
        if control.attitude_not_finite:
            return "the vehicle's attitude is not finite (NaN or infinity)"
        return f"no attitude from the vehicle for {now - control.last_sample:.1f} s"
    reason = control.reason
    if reason in (Unanswered.NO_TARGET, Unanswered.OLD_TARGET):
        return _missing_command_cause(now, control, limit)
    return "no setpoint was sent" if reason is None else reason.words


def _missing_command_cause(now: float, control: Control, limit: float) -> str:
    if now - control.last_position > limit:
        if control.position_not_finite:
            return "the vehicle's position is not finite (NaN or infinity)"
        return "no position from the vehicle"
    if not control.position_fresh:
        return "positions arrive, but older than deadman.position_stale_ms"
    return Unanswered.OLD_TARGET.words


def clock_changed(snapshot: Snapshot, _: bool) -> str | None:
    """The vehicle's clock jumped, stood still, wrapped or restarted since control began."""
    return snapshot.control.clock_change


def loss(most: float) -> Judge:
    """More than the share `most` of the vehicle's frames is lost."""

    def judge(snapshot: Snapshot, raised: bool) -> str | None:
        lost = snapshot.health.lost
        if lost is None or lost <= with_hysteresis(most, raised):
            return None
        return (
            f"{100 * lost:.0f} % of the vehicle's frames are lost, more than "
            f"safety.max_loss = {most:g} ({100 * most:g} %)"
        )

    return judge


def round_trip(most: float) -> Judge:
    """The round trip of TIMESYNC takes longer than `most`, s."""

    def judge(snapshot: Snapshot, raised: bool) -> str | None:
        seconds = snapshot.health.round_trip
        if seconds is None or seconds <= with_hysteresis(most, raised):
            return None
        return (
            f"the link's round trip takes {1e3 * seconds:.0f} ms, longer than "
            f"safety.max_round_trip_ms = {1e3 * most:.0f}"
        )

    return judge


def late_setpoints(stale: float) -> Judge:
    """Every probe answered in the last 0.7 s had a round trip longer than 1.5 times `stale`, s.

    `stale` is the largest age of a sample that is answered. If its setpoint takes as long again,
    the vehicle tilts in growing swings, while all telemetry still looks good.
    """
    most = 1.5 * stale

    def judge(snapshot: Snapshot, raised: bool) -> str | None:
        seconds = snapshot.health.uplink.round_trip
        if seconds is None or seconds <= with_hysteresis(most, raised):
            return None
        return (
            f"setpoints reach the vehicle too late: the link's round trip takes "
            f"{1e3 * seconds:.0f} ms, longer than 1.5 · deadman.telemetry_stale_ms = "
            f"{1e3 * most:.0f}"
        )

    return judge


def lost_setpoints(most: int) -> Judge:
    """More than `most` TIMESYNC probes in a row were sent and not answered.

    The telemetry still comes, otherwise `silence` has ended control before.
    """

    def judge(snapshot: Snapshot, _: bool) -> str | None:
        unanswered = snapshot.health.uplink.unanswered
        if unanswered is None or unanswered <= most:
            return None
        return (
            f"setpoints do not reach the vehicle: the last {unanswered} TIMESYNC requests, ten a "
            "second, were not answered"
        )

    return judge


def foreign_setpoints(most: int) -> Judge:
    """The autopilot reported more than `most` setpoints of another program within 5 s."""

    def judge(snapshot: Snapshot, _: bool) -> str | None:
        found = snapshot.health.foreign
        if found <= most:
            return None
        return (
            "another program sends setpoints to the vehicle: within 5 s the autopilot reported "
            f"{found} that this program did not send (ATTITUDE_TARGET)"
        )

    return judge


def deadlines(most: float) -> Judge:
    """More than the share `most` of the setpoints misses deadman.deadline_ms."""

    def judge(snapshot: Snapshot, raised: bool) -> str | None:
        missed = snapshot.health.missed
        if missed is None or missed <= with_hysteresis(most, raised):
            return None
        return (
            f"{100 * missed:.0f} % of the setpoints miss deadman.deadline_ms, more than "
            f"safety.max_missed = {most:g} ({100 * most:g} %)"
        )

    return judge


def starvation(most: float) -> Judge:
    """CPU starvation: the program's timer lost more than the share `most` of the last second."""

    def judge(snapshot: Snapshot, raised: bool) -> str | None:
        starved = snapshot.health.starved
        if starved is None or starved <= with_hysteresis(most, raised):
            return None
        return (
            f"CPU starvation: the program's timer lost {100 * starved:.0f} % of the last second, "
            f"more than safety.max_starved = {most:g} ({100 * most:g} %)"
        )

    return judge


def gaps(most: int) -> Judge:
    """The setpoints had more than `most` gaps within 5 s."""

    def judge(snapshot: Snapshot, _: bool) -> str | None:
        found = snapshot.health.gaps
        if found <= most:
            return None
        return (
            f"setpoints paused {found} times within 5 s, each time for longer than "
            "deadman.telemetry_stale_ms"
        )

    return judge


def answer_rate(least: float) -> Judge:
    """The effective rate of setpoints (`IntervalSums`) is below `least` Hz."""

    def judge(snapshot: Snapshot, raised: bool) -> str | None:
        rate = snapshot.health.answer_rate
        if rate is None or rate >= minimum_with_hysteresis(least, raised):
            return None
        return f"setpoints are sent at {rate:.0f} Hz, below link.min_attitude_rate_hz = {least:g}"

    return judge


def position_rate(least: float) -> Judge:
    """Positions come at less than `least` Hz."""

    def judge(snapshot: Snapshot, raised: bool) -> str | None:
        rate = snapshot.health.position_rate
        if rate is None or rate >= minimum_with_hysteresis(least, raised):
            return None
        return f"positions come at {rate:.0f} Hz, below link.min_position_rate_hz = {least:g}"

    return judge
