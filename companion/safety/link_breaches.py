"""Checks of the data flow: silence, the vehicle's clock, the link, and this computer.

The docstring of each check states its breach.
"""

from companion.control.loop_record import UnansweredReason
from companion.safety.monitor import BreachCheck, above, below
from companion.safety.snapshot import HEARD_TIMEOUT_S, Control, Snapshot

_STALL_SHARE = 0.5
"""If this program did not run for more than this share of the time since its last setpoint, this
computer is named as the cause."""


def silence(
    limit: float, *, vehicle_heard: bool, planner: str = "auto", guidance: str = "linear"
) -> BreachCheck:
    """No setpoint was sent for longer than `limit` s.

    `vehicle_heard`: True: the check applies only while frames come from the vehicle; False: only
    while no frames come. `planner`, `guidance`: names of the configured planner and guidance, for
    the message.
    """

    def check(snapshot: Snapshot, _: bool) -> str | None:
        now, control = snapshot.now, snapshot.control
        if (
            now - control.last_answered_arrival <= limit
            or (now - control.last_frame_noticed < HEARD_TIMEOUT_S) is not vehicle_heard
        ):
            return None
        return _silence_cause(now, control, limit, planner, guidance)

    return check


def _silence_cause(now: float, control: Control, limit: float, planner: str, guidance: str) -> str:
    if control.stall_time > _STALL_SHARE * (now - control.last_answered_arrival):
        # Data that came during the stall were read late, so they only seem old.
        return (
            f"this program did not run for {control.stall_time:.1f} s (computer overloaded or "
            "suspended)"
        )
    if now - control.last_sample_arrival > limit:
        if control.attitude_not_finite:
            return "the vehicle's attitude is not finite (NaN or infinity)"
        return f"no attitude from the vehicle for {now - control.last_sample_arrival:.1f} s"
    reason = control.reason
    if reason in (UnansweredReason.NO_TARGET, UnansweredReason.OLD_TARGET):
        return _missing_command_cause(now, control, limit, guidance)
    if reason is UnansweredReason.INVALID_RATES:
        return (
            f"the planner (planner.name: {planner}) gives no body rates: they are NaN or "
            "infinite, or it refuses the target"
        )
    return "no setpoint was sent" if reason is None else reason.text


def _missing_command_cause(now: float, control: Control, limit: float, guidance: str) -> str:
    if now - control.last_position_arrival > limit:
        if control.position_not_finite:
            return "the vehicle's position is not finite (NaN or infinity)"
        return "no position from the vehicle"
    if not control.position_fresh:
        return "positions arrive, but older than deadman.position_stale_ms"
    if control.command_not_finite:
        return f"the commands of guidance (guidance.kind: {guidance}) are NaN or infinite"
    return UnansweredReason.OLD_TARGET.text


def clock_changed(snapshot: Snapshot, _: bool) -> str | None:
    """The vehicle's clock jumped, stood still, wrapped or restarted since control began."""
    return snapshot.control.clock_change


def loss(max_share: float) -> BreachCheck:
    """More than the share `max_share` of the vehicle's frames is lost."""
    return above(
        max_share,
        lambda snapshot: snapshot.health.lost_share,
        lambda share: (
            f"{100 * share:.0f} % of the vehicle's frames are lost, more than "
            f"safety.max_loss = {max_share:g} ({100 * max_share:g} %)"
        ),
    )


def round_trip(max_seconds: float) -> BreachCheck:
    """The round trip of TIMESYNC takes longer than `max_seconds`, s."""
    return above(
        max_seconds,
        lambda snapshot: snapshot.health.round_trip,
        lambda seconds: (
            f"the link's round trip takes {1e3 * seconds:.0f} ms, longer than "
            f"safety.max_round_trip_ms = {1e3 * max_seconds:.0f}"
        ),
    )


def late_setpoints(max_sample_age: float) -> BreachCheck:
    """Every probe answered in the last 0.7 s had a round trip over 1.5 times `max_sample_age`, s.

    `max_sample_age` is the largest age at which a sample is used. If setpoints also
    arrive `max_sample_age` late, the attitude oscillates more and more, while telemetry looks good.
    """
    max_seconds = 1.5 * max_sample_age
    return above(
        max_seconds,
        lambda snapshot: snapshot.health.uplink.round_trip,
        lambda seconds: (
            f"setpoints reach the vehicle too late: the link's round trip takes "
            f"{1e3 * seconds:.0f} ms, longer than 1.5 · deadman.telemetry_stale_ms = "
            f"{1e3 * max_seconds:.0f}"
        ),
    )


def lost_setpoints(max_unanswered: int) -> BreachCheck:
    """More than `max_unanswered` TIMESYNC probes in a row were sent and not answered.

    Telemetry still arrives, else the check `silence` would have ended control earlier.
    """

    def check(snapshot: Snapshot, _: bool) -> str | None:
        unanswered = snapshot.health.uplink.unanswered_count
        if unanswered is None or unanswered <= max_unanswered:
            return None
        return (
            f"setpoints do not reach the vehicle: the last {unanswered} TIMESYNC requests, ten a "
            "second, were not answered"
        )

    return check


def foreign_setpoints(max_reports: int) -> BreachCheck:
    """The autopilot reported more than `max_reports` setpoints of another program within 5 s."""

    def check(snapshot: Snapshot, _: bool) -> str | None:
        reports = snapshot.health.foreign_reports
        if reports <= max_reports:
            return None
        return (
            "another program sends setpoints to the vehicle: within 5 s the autopilot reported "
            f"{reports} that this program did not send (ATTITUDE_TARGET)"
        )

    return check


def rare_foreign_setpoint(snapshot: Snapshot, _: bool) -> str | None:
    """The autopilot has reported a setpoint of another program since control began."""
    if not snapshot.health.any_foreign_report:
        return None
    return (
        "another program may send setpoints to the vehicle now and then: the autopilot reported "
        "one that this program did not send (ATTITUDE_TARGET)"
    )


def frozen_telemetry(snapshot: Snapshot, _: bool) -> str | None:
    """Attitude, position or velocity repeats one measurement under new time stamps."""
    repeated_telemetry = snapshot.health.frozen_telemetry
    return None if repeated_telemetry is None else f"frozen telemetry: {repeated_telemetry}"


def deadlines(max_share: float) -> BreachCheck:
    """More than the share `max_share` of the setpoints misses deadman.deadline_ms."""
    return above(
        max_share,
        lambda snapshot: snapshot.health.missed_share,
        lambda share: (
            f"{100 * share:.0f} % of the setpoints miss deadman.deadline_ms, more than "
            f"safety.max_missed = {max_share:g} ({100 * max_share:g} %)"
        ),
    )


def starvation(max_share: float) -> BreachCheck:
    """CPU starvation: this program's timer was late for more than `max_share` of a second."""
    return above(
        max_share,
        lambda snapshot: snapshot.health.starved_share,
        lambda share: (
            f"CPU starvation: the program's timer was late for {100 * share:.0f} % of the last "
            f"second, more than safety.max_starved = {max_share:g} ({100 * max_share:g} %)"
        ),
    )


def gaps(max_gaps: int) -> BreachCheck:
    """The setpoints had more than `max_gaps` gaps within 5 s."""

    def check(snapshot: Snapshot, _: bool) -> str | None:
        count = snapshot.health.gaps
        if count <= max_gaps:
            return None
        return (
            f"setpoints paused {count} times within 5 s, each time for longer than "
            "deadman.telemetry_stale_ms"
        )

    return check


def answer_rate(min_rate: float) -> BreachCheck:
    """The effective rate of setpoints (`IntervalSums`) is below `min_rate` Hz."""
    return below(
        min_rate,
        lambda snapshot: snapshot.health.answer_rate,
        lambda rate: (
            f"setpoints are sent at {rate:.0f} Hz, below link.min_attitude_rate_hz = {min_rate:g}"
        ),
    )


def position_rate(min_rate: float) -> BreachCheck:
    """Positions come at less than `min_rate` Hz."""
    return below(
        min_rate,
        lambda snapshot: snapshot.health.position_rate,
        lambda rate: (
            f"positions come at {rate:.0f} Hz, below link.min_position_rate_hz = {min_rate:g}"
        ),
    )
