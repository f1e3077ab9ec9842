"""What the flight lives on: the battery, the link, and this computer's time."""

from companion.safety.monitor import RELEASE, Judge, released
from companion.safety.snapshot import Snapshot
from companion.vehicle.records import outdated


def battery(least: float) -> Judge:
    """Less than the share `least` is left, or nobody says how much."""

    def judge(snapshot: Snapshot, _: bool) -> str | None:
        told = snapshot.autopilot.battery
        if told is None:
            return None
        if outdated(told.received, snapshot.now):  # silence hides an empty one
            return "the battery's state is not reported any more"
        if told.remaining is None or told.remaining >= least:
            return None
        return (
            f"battery at {100 * told.remaining:.0f} %, below "
            f"limits.min_battery_percent {100 * least:.0f}"
        )

    return judge


def loss(most: float) -> Judge:
    """A larger share than `most` of the vehicle's frames is lost on the way."""

    def judge(snapshot: Snapshot, raised: bool) -> str | None:
        lost = snapshot.health.lost
        if lost is None or lost <= released(most, raised):
            return None
        return f"{100 * lost:.0f} % of the vehicle's frames are lost"

    return judge


def round_trip(most: float) -> Judge:
    """A question and its answer take longer than `most`, s."""

    def judge(snapshot: Snapshot, raised: bool) -> str | None:
        seconds = snapshot.health.round_trip
        if seconds is None or seconds <= released(most, raised):
            return None
        return f"the link's round trip takes {1e3 * seconds:.0f} ms"

    return judge


def deadlines(most: float) -> Judge:
    """A larger share than `most` of our answers misses deadman.deadline_ms."""

    def judge(snapshot: Snapshot, raised: bool) -> str | None:
        missed = snapshot.health.missed
        if missed is None or missed <= released(most, raised):
            return None
        return f"{100 * missed:.0f} % of the answers miss deadman.deadline_ms"

    return judge


def starvation(most: float) -> Judge:
    """Our timer is late by a larger share of the time than `most`."""

    def judge(snapshot: Snapshot, raised: bool) -> str | None:
        starved = snapshot.health.starved
        if starved is None or starved <= released(most, raised):
            return None
        return f"this computer has no time for us: {100 * starved:.0f} % of it are lost"

    return judge


def gaps(most: int) -> Judge:
    """Answers paused more often than `most` times within a few seconds, each for too long."""

    def judge(snapshot: Snapshot, _: bool) -> str | None:
        found = snapshot.health.gaps
        if found <= most:
            return None
        return (
            f"samples could not be answered {found} times within 5 s for longer than "
            "deadman.telemetry_stale_ms"
        )

    return judge


def answer_rate(least: float) -> Judge:
    """Fewer than `least` samples a second are answered, or as unevenly, Hz."""

    def judge(snapshot: Snapshot, raised: bool) -> str | None:
        rate = snapshot.health.answer_rate
        if rate is None or rate >= least * (1.0 / RELEASE if raised else 1.0):
            return None
        return f"attitude is answered at {rate:.0f} Hz, below link.min_attitude_rate_hz = {least:g}"

    return judge


def position_rate(least: float) -> Judge:
    """Fewer than `least` positions a second come, Hz."""

    def judge(snapshot: Snapshot, raised: bool) -> str | None:
        rate = snapshot.health.position_rate
        if rate is None or rate >= least * (1.0 / RELEASE if raised else 1.0):
            return None
        return f"positions come at {rate:.0f} Hz, below link.min_position_rate_hz = {least:g}"

    return judge
