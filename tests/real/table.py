"""Rows of flights as one page: `python -m tests.real.table FOLDER...` reads their rows.jsonl.

`--into docs/real-autopilots.md` puts the page between the marks in that file.

Figures are medians over the flights of one kind. `mock` is the truth of the same flight on the mock
with that autopilot's rules, where it was flown, and `ratio` that of the real one to it.
"""

import argparse
import json
import sys
from collections.abc import Iterable
from pathlib import Path
from statistics import median

_SAID = ("reported", "telemetry", "truth", "along", "across", "height", "estimator")
_HEAD = (
    "vehicle",
    "flight",
    "planner",
    *_SAID,
    "wander, °",
    "late, ms",
    "flown",
    "load",
    "mock",
    "ratio",
)
STRAIGHT, TRACKING = "Straightness: largest distance from the line of a step", "Tracking: RMS, m"


_BEGIN, _END = "<!-- table: python -m tests.real.table FOLDER -->", "<!-- end of table -->"


def main() -> int:
    """Print the page of what these folders hold, or put it into a file."""
    parser = argparse.ArgumentParser(prog="python -m tests.real.table", description=__doc__)
    parser.add_argument("folders", nargs="+", type=Path)
    parser.add_argument("--into", type=Path, metavar="FILE")
    options = parser.parse_args()
    page = markdown(read(options.folders))
    if options.into is None:
        print(page)
    else:
        options.into.write_text(with_page(options.into.read_text(), page))
    return 0


def with_page(text: str, page: str) -> str:
    """A file's text with the page between its marks.

    Raises:
        ValueError: it has no marks.
    """
    before, begin, rest = text.partition(_BEGIN)
    _, end, after = rest.partition(_END)
    if not begin or not end:
        raise ValueError(f"the file lacks the lines {_BEGIN} and {_END}")
    return f"{before}{begin}\n\n{page}\n{end}{after}"


def read(folders: Iterable[Path]) -> list[dict]:
    """All rows of folders that `figures` wrote, or of folders of such folders."""
    files = [path for folder in folders for path in sorted(folder.rglob("rows.jsonl"))]
    return [json.loads(line) for path in files for line in path.read_text().splitlines()]


def markdown(rows: list[dict]) -> str:
    """The page."""
    parts = [_figures(rows, STRAIGHT, straightness), _figures(rows, TRACKING, tracking)]
    parts += [_identified(rows), _incidents(rows), _series(rows), _failed(rows)]
    return "\n".join(part for part in parts if part)


def straightness(row: dict) -> dict[str, dict]:
    """Cross-axis of a flight's steps, by the flight's name."""
    cross = row.get("cross_axis")
    if cross is None:
        return {}
    measured = {"late": cross.get("attitude_late_ms"), "wander": cross.get("heading_wander_deg")}
    return {_name(row): {**cross, **measured}}


def tracking(row: dict) -> dict[str, dict]:
    """Errors of a flight's maneuvers, by their names."""
    out = {}
    variant = _name(row).partition("@")[2]
    for name, part in row.get("tracking", {}).items():
        nearest = part.get("truth", part["telemetry"])
        out[name + (f"@{variant}" if variant else "")] = {
            "reported": row["reported"]["position_rms_m"],
            "telemetry": part["telemetry"]["rms"],
            "truth": part.get("truth", {}).get("rms"),
            "estimator": part.get("estimator", {}).get("rms"),
            **{key: nearest.get(key) for key in ("along", "across", "height")},
            "late": nearest.get("late_ms"),
        }
    return out


def _figures(rows: list[dict], title: str, figures) -> str:
    kinds: dict[tuple[str, str, str], list[dict]] = {}
    for row in rows:
        for name, values in figures(row).items():
            key = (_vehicle(row), name, row.get("planner", ""))
            kinds.setdefault(key, []).append({**values, "load": _load(row)})
    lines = [_line(key, flown, _mocks(kinds, key)) for key, flown in sorted(kinds.items())]
    if not lines:
        return ""
    filled = [k for k in range(len(_HEAD)) if any(line[k] for line in lines)]  # no empty columns
    return _table(title, [_HEAD[k] for k in filled], [[line[k] for k in filled] for line in lines])


def _mocks(kinds: dict[tuple[str, str, str], list[dict]], key: tuple[str, str, str]) -> list[dict]:
    """The same flights on the mock vehicle, whose rate loop is known without `identify`."""
    vehicle, name, planner = key
    return kinds.get((f"mock-{vehicle}", name.removesuffix("@identified"), planner), [])


def _line(key: tuple[str, str, str], flown: list[dict], mocks: list[dict]) -> list[str]:
    loads = [each["load"] for each in flown]
    cells = [*key, *(_text(_median(flown, name), 4) for name in _SAID)]
    cells += [_text(_median(flown, "wander"), 2)]
    cells += [_text(_median(flown, "late"), 1), str(len(flown)), f"{min(loads)}-{max(loads)}"]
    mock, real = _median(mocks, "truth"), _median(flown, "truth")
    ratio = real / mock if mock and real is not None else None
    return [*cells, _text(mock, 4), _text(ratio, 2)]


def _identified(rows: list[dict]) -> str:
    found: dict[tuple[str, str], list[dict]] = {}
    tried: dict[str, int] = {}
    for row in rows:
        if row["flight"] != "identify":
            continue
        tried[_vehicle(row)] = tried.get(_vehicle(row), 0) + 1
        for axis, told in row.items():
            if isinstance(told, dict) and told.get("lag_ms") is not None:
                found.setdefault((_vehicle(row), axis), []).append(told)
    lines = []
    for (vehicle, axis), told in found.items():
        cells = [
            f"{median(values):.1f} ({min(values):.1f} to {max(values):.1f})"
            for name in ("lag_ms", "dead_time_ms")
            for values in [[each[name] for each in told]]
        ]
        lines.append([vehicle, axis, *cells, f"{len(told)} of {tried[vehicle]}"])
    head = ("vehicle", "axis", "lag, ms: median (least to most)", "dead time, ms", "found")
    return _table("Identified", head, lines) if lines else ""


def _incidents(rows: list[dict]) -> str:
    lines = [
        [
            _vehicle(row),
            row.get("ends_by", row["flight"]),
            row.get("result") or "",
            _text(row.get("last_setpoint_s"), 3),
            ", ".join(f"{mode} {at}" for at, mode in row.get("modes", [])),
            _text(row.get("farthest_m"), 2),
            str(_load(row)),
        ]
        for row in rows
        if row.get("ends_by", row["flight"]) in ("kill", "takeover")
    ]
    head = (
        "vehicle",
        "event",
        "the program",
        "last setpoint, s",
        "modes, s",
        "farthest, m",
        "load",
    )
    return (
        _table("Kill and takeover, from a hover; times after the event", head, lines)
        if lines
        else ""
    )


def _series(rows: list[dict]) -> str:
    lines = [
        [
            _vehicle(row),
            str(row["number"]),
            row["after"] or "a fresh start",
            f"after {row['began_after_s']} s" if "began_after_s" in row else row["did_not_begin"],
            row["ends_by"],
            row.get("error") or row.get("result") or "",
            row["left_in"],
        ]
        for row in rows
        if row["flight"] == "ten"
    ]
    head = ("vehicle", "flight", "after", "began", "ends by", "result", "left in")
    return _table("Ten flights without a restart", head, lines) if lines else ""


def _failed(rows: list[dict]) -> str:
    lines = [
        f"- {_vehicle(row)}, {row['flight']} (load {_load(row)}): {row['error']}"
        for row in rows
        if "error" in row and row["flight"] != "ten"
    ]
    return "\n".join(["### Not flown to the end", "", *lines, ""]) if lines else ""


def _table(title: str, head: Iterable[str], lines: list[list[str]]) -> str:
    head = list(head)
    rule = "|" + "---|" * len(head)
    body = [
        "| " + " | ".join(cell.replace("|", "/") for cell in line) + " |" for line in [head, *lines]
    ]
    return "\n".join([f"### {title}", "", body[0], rule, *body[1:], ""])


def _name(row: dict) -> str:
    return row["flight"].partition(":")[0]


def _vehicle(row: dict) -> str:
    return row["vehicle"] + ("" if row["airframe"] == "stock" else f" {row['airframe']}")


def _load(row: dict) -> float:
    return float(row.get("load", "nan").split()[0])


def _median(flown: list[dict], name: str) -> float | None:
    values = [each[name] for each in flown if each.get(name) is not None]
    return median(values) if values else None


def _text(value: float | None, digits: int) -> str:
    return "" if value is None else f"{value:.{digits}f}"


if __name__ == "__main__":
    sys.exit(main())
