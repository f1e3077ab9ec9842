"""`companion bench planner`: the time of one step of a planner, in a flight and in a batch.

Times are the shortest of many short repeats without garbage collection, so that other load on the
computer has little effect. Between these repeats two baselines are measured in the same way: a bare
Python call, and a copy of the same arrays.
"""

from collections.abc import Callable
from time import perf_counter
from timeit import Timer
from typing import Any, NamedTuple

import numpy as np
from rich.console import Console
from rich.table import Table

from companion import batch
from companion.attitude import LAW_NAMES, Limits, Target, make_planner
from companion.attitude.planner import LawPlanner
from companion.batch.loops import Array
from companion.extras import pip_command

BATCH_SIZES = (1, 1_000, 10_000)
"""Numbers of vehicles in the batches whose single step is timed."""
VEHICLE_COUNT = 1_000
"""Number of vehicles in the simulated batch, at `RATE_HZ` samples per second."""
RATE_HZ = 1_000.0

_LIMITS = Limits(max_tilt=0.6, max_tilt_rate=1.5, max_yaw_rate=1.0)
_REPEAT_S = 2e-3  # short, so that some repeats are undisturbed
_STEPS, _STEPS_IN_PYTHON = 4_000, 10  # number of steps of `advance` in a repeat


class _Case(NamedTuple):
    """Code whose run time is measured."""

    group: str
    """Key of the group in the result."""
    key: str
    """Key of the case in its group."""
    timer: Timer
    """Runs the case."""
    steps: int
    """Number of planner steps in one run."""


def run(seconds: float, as_json: bool) -> dict[str, Any]:
    """Measure every planner that keeps no state, interleaved with the baselines.

    Args:
        seconds: duration of the measurement, s, to which compiling adds; at least one round is
            measured.
        as_json: print nothing; the caller prints the result.

    Returns:
        - `compiled`: whether numba compiled the batches.
        - `flight_ns`: time of a step of `planner.rates` on plain floats, by planner; its `baseline`
          is a Python function that returns its argument.
        - `new_target_ns`: like `flight_ns`, with a new target in each step, which is checked.
        - `batch_ns`: time of a step in `batch.rates` with its checks, by planner and number of
          vehicles; its `baseline` is a copy of the same attitudes and targets.
        - `flight_ratio`, `new_target_ratio`, `batch_ratio`: the times divided by their baselines.
        - `simulated`: `step_ns`, time of a step of one vehicle with `first-order`, by
          `batch.advance`; `seconds_per_second`, simulated time per computing time, for
          `vehicles` vehicles at `rate_hz` samples per second.
    """
    compiled = batch.can_compile()
    cases = [*_flight_cases(), *_batch_cases(compiled), _advance_case(compiled)]
    groups = _shortest_ns(cases, seconds)
    flight, batches = groups["flight"], {str(count): groups[str(count)] for count in BATCH_SIZES}
    step = groups["advance"]["first-order"]
    figures = {
        "compiled": compiled,
        "flight_ns": _rounded(flight),
        "flight_ratio": _ratios(flight),
        "new_target_ns": _rounded(groups["new target"]),
        "new_target_ratio": _ratios(groups["new target"]),
        "batch_ns": {count: _rounded(group) for count, group in batches.items()},
        "batch_ratio": {count: _ratios(group) for count, group in batches.items()},
        "simulated": {
            "vehicles": VEHICLE_COUNT,
            "rate_hz": RATE_HZ,
            "step_ns": round(step, 2),
            "seconds_per_second": round(1e9 / (step * VEHICLE_COUNT * RATE_HZ), 3),
        },
    }
    if not as_json:
        _show(figures)
    return figures


def _flight_cases() -> list[_Case]:
    """Cases of a step with an unchanged target, which is usual in flight, and with a new target."""
    q, targets = _fleet(2)
    first_target, other_target = (Target(*row) for row in targets.T.tolist())
    values: dict[str, Any] = {
        "q": tuple(q[:, 0].tolist()),
        "same": first_target,
        "other": other_target,
    }
    functions: dict[str, Callable[..., Any]] = {"baseline": _first_argument}
    functions |= {name: _planner(name).rates for name in LAW_NAMES}
    return [
        _Case(group, key, Timer(statement, globals={**values, "f": function}), 2)
        for key, function in functions.items()
        for group, statement in (
            ("flight", "f(q, same, 0.004); f(q, same, 0.004)"),
            ("new target", "f(q, same, 0.004); f(q, other, 0.004)"),
        )
    ]


def _first_argument(q: Any, target: Any, dt: float) -> Any:
    return q


def _batch_cases(compiled: bool) -> list[_Case]:
    cases = []
    for count in BATCH_SIZES:
        q, targets = _fleet(count)
        values: dict[str, Any] = {"q": q, "targets": targets, "compiled": compiled}
        copy_timer = Timer("q.copy(), targets.copy()", globals=values)
        cases.append(_Case(str(count), "baseline", copy_timer, count))
        for name in LAW_NAMES:
            values = {**values, "rates": batch.rates, "planner": _planner(name)}
            timer = Timer("rates(planner, q, targets, 0.004, compiled)", globals=values)
            cases.append(_Case(str(count), name, timer, count))
    return cases


def _advance_case(compiled: bool) -> _Case:
    q, targets = _fleet(VEHICLE_COUNT)
    planner = _planner("first-order")
    steps = _STEPS if compiled else _STEPS_IN_PYTHON
    timer = Timer(lambda: batch.advance(planner, q, targets, 1.0 / RATE_HZ, steps, compiled))
    return _Case("advance", "first-order", timer, VEHICLE_COUNT * steps)


def _planner(name: str) -> LawPlanner:
    planner = make_planner(name, limits=_LIMITS)
    assert isinstance(planner, LawPlanner)
    return planner


def _fleet(count: int) -> tuple[Array, Array]:
    """Attitudes (4, n) at many headings, some with a large tilt, and targets (4, n) in the limits.

    `count` is n, the number of vehicles.
    """
    random = np.random.default_rng(1)
    q = random.normal(size=(4, count))
    q[0] = 1.5 + np.abs(q[0])
    q /= np.linalg.norm(q, axis=0)
    return q, random.uniform(-0.39, 0.39, size=(4, count))


def _shortest_ns(cases: list[_Case], seconds: float) -> dict[str, dict[str, float]]:
    """The shortest time of a step, ns, by group and key of the cases."""
    repeat_counts = []
    for case in cases:
        case.timer.timeit(1)  # compiles
        repeat_counts.append(max(1, int(_REPEAT_S / case.timer.timeit(1))))
    shortest_ns: dict[str, dict[str, float]] = {case.group: {} for case in cases}
    deadline = perf_counter() + seconds
    while True:
        for case, repeats in zip(cases, repeat_counts, strict=True):
            ns = 1e9 * case.timer.timeit(repeats) / (repeats * case.steps)
            shortest_ns[case.group][case.key] = min(ns, shortest_ns[case.group].get(case.key, ns))
        if perf_counter() >= deadline:
            return shortest_ns


def _rounded(group: dict[str, float]) -> dict[str, float]:
    return {key: round(ns, 2) for key, ns in group.items()}


def _ratios(group: dict[str, float]) -> dict[str, float]:
    return {key: round(ns / group["baseline"], 2) for key, ns in group.items() if key != "baseline"}


def _show(figures: dict[str, Any]) -> None:
    how_computed = "compiled by numba" if figures["compiled"] else "in Python"
    table = Table(
        title="Time of a planner step: ns, and multiple of the baseline (best of many repeats; "
        f"batches {how_computed})",
        caption="baseline: a Python call that does nothing; for batches, copying their attitudes "
        "and targets",
    )
    table.add_column("", no_wrap=True)
    for column_title in ("flight", "new target", *(f"of {count:,}" for count in BATCH_SIZES)):
        table.add_column(column_title, justify="right", no_wrap=True)
    columns = [(figures[f"{key}_ns"], figures[f"{key}_ratio"]) for key in ("flight", "new_target")]
    columns += [(figures["batch_ns"][str(n)], figures["batch_ratio"][str(n)]) for n in BATCH_SIZES]
    for key in ("baseline", *LAW_NAMES):
        table.add_row(key, *(_cell(ns[key], ratio.get(key)) for ns, ratio in columns))
    simulated = figures["simulated"]
    console = Console()
    console.print(table)
    console.print(
        f"One core simulates {simulated['seconds_per_second']:.3g} s of flight per second: "
        f"{VEHICLE_COUNT:,} vehicles at {RATE_HZ:g} Hz, first-order,"
        f" {simulated['step_ns']:.3g} ns for each step and its rotation. This is batch.advance,"
        " which checks its arrays once; batch.rates checks its arrays at every call.",
        highlight=False,
    )
    if not figures["compiled"]:
        console.print(
            f"Batches are far quicker with numba: {pip_command('study')}",
            markup=False,
            highlight=False,
        )


def _cell(ns: float, ratio: float | None) -> str:
    time_text = f"{ns:,.0f}" if ns >= 100.0 else f"{ns:.3g}"
    return time_text if ratio is None else f"{time_text} {ratio:.0f}×"
