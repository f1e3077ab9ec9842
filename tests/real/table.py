"""Rows of flights as one table."""

from collections.abc import Iterable
from statistics import median

HEAD = (
    "| vehicle | flight | planner | figure | reported | telemetry | truth | along | across | height"
    " | estimator | late ms | flown | load |\n|" + "---|" * 14
)


def markdown(rows: Iterable[dict]) -> str:
    """Medians of the flights of one kind on one vehicle, and how many there were."""
    cells: dict[tuple[str, ...], list[dict]] = {}
    failed: list[str] = []
    for row in rows:
        for figure, values in figures(row).items():
            key = (_vehicle(row), row["flight"].partition(":")[0], row.get("planner", ""), figure)
            cells.setdefault(key, []).append({**values, "load": float(row["load"].split()[0])})
        if "error" in row:
            failed.append(f"- {_vehicle(row)}, {row['flight']}: {row['error']}")
    lines = [HEAD]
    for key, flown in cells.items():
        columns = ("reported", "telemetry", "truth", "along", "across", "height", "estimator")
        told = [_cell(flown, name, 4) for name in columns]
        loads = [each["load"] for each in flown]
        told += [_cell(flown, "late_ms", 1), str(len(flown)), f"{min(loads):.1f}-{max(loads):.1f}"]
        lines.append("| " + " | ".join([*key, *told]) + " |")
    return "\n".join([*lines, "", *failed]) + "\n"


def figures(row: dict) -> dict[str, dict[str, float | None]]:
    """What one flight says, by the name of the figure."""
    out: dict[str, dict[str, float | None]] = {}
    if "cross_axis" in row:
        cross = row["cross_axis"]
        out["cross-axis"] = {
            **{name: cross[name] for name in ("reported", "telemetry", "truth")},
            "late_ms": cross["attitude_late_ms"],
        }
    for name, part in row.get("tracking", {}).items():
        true = part["truth"]
        out[f"RMS {name}, m"] = {
            "reported": row["reported"]["position_rms_m"],
            "telemetry": part["telemetry"]["rms"],
            "truth": true["rms"],
            "estimator": part["estimator"]["rms"],
            **{key: true.get(key) for key in ("along", "across", "height", "late_ms")},
        }
    return out


def _vehicle(row: dict) -> str:
    return row["vehicle"] + ("" if row["airframe"] == "stock" else f", {row['airframe']}")


def _cell(flown: list[dict], name: str, digits: int) -> str:
    values = [each[name] for each in flown if each.get(name) is not None]
    return f"{median(values):.{digits}f}" if values else ""
