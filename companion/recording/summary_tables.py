"""The tables of measurements that `companion fly` prints after a flight."""

from math import isnan

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from companion.recording.closing_words import ClosingWords
from companion.recording.measurements.summary import PredictiveFigures, Summary


def flight_table(summary: Summary) -> RenderableType:
    """All tables and notes of a flight."""
    parts: list[RenderableType] = []
    if len(summary.trace.response):
        parts.append(_response(summary))
    if summary.maneuvers():
        parts.append(_tracking(summary))
    if len(summary.trace.rates):
        parts.append(_dead_times(summary))
    if summary.predictive is not None:
        parts.append(_predictive_words(summary.predictive))
    if summary.counts.setpoints:
        if not summary.facts.lockstep:  # vehicle time has no latency
            parts.append(_loop(summary))
        parts.append(_loop_words(summary))
    return Group(*parts)


def styled_text(closing_words: ClosingWords) -> Text:
    """The closing words as coloured text."""
    style = "green" if closing_words.was_good else "yellow" if closing_words.completed else "red"
    text = Text(closing_words.headline, style=f"bold {style}")
    for line in closing_words.lines:
        text.append(f"\n{line}", style="yellow" if line.startswith("!") else "not bold default")
    if closing_words.next_command is not None:
        text.append("\nNext: ", style="not bold default")
        text.append(closing_words.next_command, style="bold default")
    return text


def _empty_table(title: str, *columns: str) -> Table:
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
    table = _empty_table("Acceleration response to steps", "measured", "ideal (1/p)")
    for axis, value in (
        ("north", response.time_constant_north_s),
        ("east", response.time_constant_east_s),
    ):
        time_text = "not flown" if isnan(value) else f"{value:.3f} s"
        table.add_row(f"time constant {axis}", time_text, f"{ideal:.3f} s")
    table.add_row(
        "largest deviation from ċ = p(c_d − c)", f"{response.model_deviation_max:.4f}", "0"
    )
    table.add_row(
        "straightness: largest distance from a step's line", f"{response.cross_axis_max:.4f}", "0"
    )
    model = response.second_order
    table.add_section()
    table.add_row("nearest second order: frequency ω", f"{model.frequency:.1f} rad/s", "")
    table.add_row("damping ζ", f"{model.damping:.2f}", "")
    table.add_row("dead time", f"{1e3 * model.dead_time:.0f} ms", "")
    table.add_row(
        "largest deviation from this model", f"{response.second_order_deviation_max:.4f}", "0"
    )
    return table


def _dead_times(summary: Summary) -> RenderableType:
    """Measured and configured dead times."""
    dead_times = summary.dead_times
    if not dead_times.lag_known:
        words = "dead time not measured: vehicle.lag_ms is not set (`companion identify` finds it)"
        return Text(words, style="dim")
    table = _empty_table(
        "Dead time, from a sample to the effect of its setpoint", "measured", "configured"
    )
    for name, axis in dead_times.axes.items():
        unknown = "not enough rotation to measure" if axis.measured is None else ""
        table.add_row(name, unknown or _milliseconds(axis.measured), _milliseconds(axis.configured))
    age = dead_times.sample_age
    if not isnan(age.p50):
        table.add_row(
            "of which sample age (p50, p99)", f"{1e3 * age.p50:.1f}, {1e3 * age.p99:.1f} ms", ""
        )
    return table


def _milliseconds(value: float | None) -> str:
    return "–" if value is None else f"{1e3 * value:.0f} ms"


def _tracking(summary: Summary) -> RenderableType:
    """Horizontal and vertical errors of the maneuvers."""
    table = _empty_table(
        "Tracking by maneuver", "horizontal RMS", "largest", "height RMS", "largest"
    )
    for maneuver in summary.maneuvers():
        errors = maneuver.horizontal_rms, maneuver.horizontal_max
        level = [_with_unit(error, "m", 2) for error in errors]
        if maneuver.open_loop:
            level = ["open loop", f"{maneuver.drift:.2f} m of drift"]
        heights = _with_unit(maneuver.height_rms, "m", 2), _with_unit(maneuver.height_max, "m", 2)
        table.add_row(maneuver.name, *level, *heights)
    return table


def _predictive_words(figures: PredictiveFigures) -> Text:
    """Counts and times of predictive control, in words."""
    times = figures.as_dict()["solve_ms"]
    words = f"predictive control: {figures.used_answers} answers flown"
    if figures.used_answers:
        words += f", computed in {times['p50']:.1f} ms (p99 {times['p99']:.1f} ms)"
    unused_text = ", ".join(f"{count} {name}" for name, count in figures.unused_answers.items())
    if unused_text:
        words += (
            f"; linear guidance replaced {sum(figures.unused_answers.values())} other answers: "
            f"{unused_text}"
        )
    return Text(words)


def _loop(summary: Summary) -> RenderableType:
    latency = summary.latency_us()
    table = _empty_table("Control loop", "p50", "p99", "largest")
    table.add_row(
        "sample in → setpoint out",
        *(_with_unit(latency[key], "µs", 0) for key in ("p50", "p99", "max")),
    )
    return table


def _loop_words(summary: Summary) -> Text:
    counts, link = summary.counts, summary.link
    reasons = [
        f"{count} {name.replace('_', ' ')}" for name, count in counts.unanswered.items() if count
    ]
    unanswered = f"\nunanswered samples: {', '.join(reasons)}" if reasons else ""
    missed_text = "" if summary.facts.lockstep else f"{counts.missed_deadlines} missed deadlines, "
    rate_text = f", {counts.rate_hz:.0f} Hz in the maneuvers" if counts.rate_hz else ""
    return Text(
        f"{counts.setpoints} setpoints for {counts.samples} samples{rate_text}\n{missed_text}"
        f"{counts.stale} stale, {counts.refused} refused; link: {link.get('lost', 0)} lost, "
        f"{link.get('bad_crc', 0)} damaged, {link.get('non_finite', 0)} not finite{unanswered}"
    )


def _with_unit(value: float, unit: str, digits: int) -> str:
    return "–" if isnan(value) else f"{value:.{digits}f} {unit}"
