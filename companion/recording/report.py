"""What a person reads after a flight: a table of what was measured."""

from math import isnan

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from companion.recording.summary import Summary


def flight_table(summary: Summary) -> RenderableType:
    """The table that `companion fly` ends with."""
    parts: list[RenderableType] = [_verdict(summary)]
    if len(summary.trace.response):
        parts.append(_response(summary))
    if len(summary.trace.tracking):
        parts.append(_tracking(summary))
    if summary.counts.setpoints:
        parts += [_loop(summary), _loop_words(summary)]
    return Group(*parts)


def _verdict(summary: Summary) -> Text:
    ok = summary.result == "ok"
    words = "flight ok" if ok else f"flight ended in `{summary.phase}`: {summary.result}"
    return Text(words, style="bold green" if ok else "bold red")


def _table(title: str, *columns: str) -> Table:
    table = Table(title=title, title_justify="left", title_style="bold", min_width=66)
    table.add_column("")
    for column in columns:
        table.add_column(column, justify="right")
    return table


def _response(summary: Summary) -> RenderableType:
    response = summary.response()
    if response is None:
        return Text("no acceleration step was flown to its end", style="dim")
    ideal = 1.0 / summary.gain
    table = _table("Acceleration response to steps", "measured", "ideal (1/p)")
    for axis, value in (
        ("north", response.time_constant_north_s),
        ("east", response.time_constant_east_s),
    ):
        table.add_row(f"time constant {axis}", _number(value, "s", 3), f"{ideal:.3f} s")
    table.add_row(
        "largest deviation from ċ = p(c_d − c)", f"{response.model_deviation_max:.4f}", "0"
    )
    table.add_row("largest cross-axis movement", f"{response.cross_axis_max:.4f}", "0")
    return table


def _tracking(summary: Summary) -> RenderableType:
    tracking = summary.tracking()
    table = _table("Tracking", "RMS", "largest")
    table.add_row(
        "position",
        _number(tracking["position_rms_m"], "m", 2),
        _number(tracking["position_max_m"], "m", 2),
    )
    table.add_row("height", _number(tracking["height_rms_m"], "m", 2), "")
    return table


def _loop(summary: Summary) -> RenderableType:
    latency = summary.latency_us()
    table = _table("Control loop", "p50", "p99", "largest")
    table.add_row(
        "sample in → setpoint out",
        *(_number(latency[key], "µs", 0) for key in ("p50", "p99", "max")),
    )
    return table


def _loop_words(summary: Summary) -> Text:
    counts, link = summary.counts, summary.link
    return Text(
        f"{counts.setpoints} setpoints for {counts.samples} samples, {counts.rate_hz:.0f} Hz "
        f"in the programme\n{counts.missed_deadlines} missed deadlines, {counts.stale} too old, "
        f"{counts.refused} refused; link: {link.get('lost', 0)} lost, "
        f"{link.get('bad_crc', 0)} damaged, {link.get('non_finite', 0)} not finite"
    )


def _number(value: float, unit: str, digits: int) -> str:
    return "–" if isnan(value) else f"{value:.{digits}f} {unit}"
