"""The study put together: what is flown, and the page's section made of it."""

from companion.study.outcome import Outcome, Tick
from companion.study.track.figure import CAPTION, draw_figure
from companion.study.track.findings import find
from companion.study.track.fleet import fly_all
from companion.study.track.flight import GUSTS, MAX_TILT_DEG, MAX_TILT_RATE_DEG_S, POSITION_RATE_HZ
from companion.study.track.tables import rows, series, tables
from companion.study.track.task import HALF_WIDTH_M, RADIUS_M, WINDY, tasks

PARTS = len(tasks())


def run(tick: Tick) -> Outcome:
    """Fly every task, and tell how far off each was.

    Raises:
        ConfigError, VehicleStoppedError: as `fly_all`.
    """
    flown = fly_all(tasks(), tick)
    return Outcome(
        name="track",
        title="Track: how near to a trajectory",
        conditions=(
            f"A circle of {RADIUS_M:g} m radius at a steady speed and a figure-eight (Gerono) of"
            f" {HALF_WIDTH_M:g} m half width at its fastest, each from rest to rest: whole flights"
            " over MAVLink with the bundled PX4-like vehicle, in lockstep. Its rate loop answers"
            " as measured on PX4, it has 1 s⁻¹ of drag and its usual noise; its position comes at"
            f" {POSITION_RATE_HZ:g} Hz, 10 ms old and with 1 cm of noise. The companion is as"
            f" configs/mock-px4.yaml has it, with {MAX_TILT_DEG:g}° of tilt and"
            f" {MAX_TILT_RATE_DEG_S:g} °/s. The wind is {WINDY:g} m/s from north with gusts of"
            f" {GUSTS * WINDY:g} m/s (standard deviation, north and east). All flights have the"
            " same seed, and so the same noise and the same gusts: with another one the differences"
            " between planners come out the same within 0.2 mm. By telemetry an error is told from"
            " the position that guidance works with. The vehicle really is ahead of that by what it"
            " flies in 10 ms, so that by the truth a planner gains that is late by as much."
        ),
        figure=draw_figure(flown),
        caption=CAPTION,
        tables=tables(flown),
        findings=find(flown),
        series=(series(flown),),
        rows=rows(flown),
    )
