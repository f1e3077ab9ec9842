"""Measures the processor time of each part of the program and of the mock vehicle by sampling."""

import signal
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from types import FrameType

SAMPLE_PERIOD_S = 0.001
"""Processor time between two samples, s."""
PROGRAM_PARTS = {
    "event loop and wire": (
        "companion/testing/",
        "companion/mavlink/lockstep.py",
        "companion/mavlink/loop.py",
    ),
    "vehicle: physics, estimate": ("sitl_mock/physics/",),
    "vehicle: messages": ("sitl_mock/link/", "sitl_mock/exchange.py"),
    "vehicle: autopilot": ("sitl_mock/",),
    "link: frames, messages, state": ("companion/mavlink/", "companion/vehicle/"),
    "planner": ("companion/attitude/",),
    "control loop": (
        "companion/control/control_loop.py",
        "companion/control/planner_runner.py",
        "companion/control/estimator_resets.py",
        "companion/control/loop_record.py",
    ),
    "guidance": ("companion/guidance/", "companion/control/"),
    "safety, phases, checks": (
        "companion/safety/",
        "companion/flight/",
        "companion/preflight/",
        "companion/api/",
    ),
    "recording": ("companion/recording/",),
}
"""Files and folders of each part; a file belongs to the first part that names it."""
_OTHER_CODE = "rest"
_SOURCE_ROOTS = tuple(
    f"{Path(spec.origin).parents[1]}/"
    for spec in map(find_spec, ("companion", "sitl_mock"))
    if spec is not None and spec.origin is not None
)


@contextmanager
def sampling() -> Iterator[Counter[str]]:
    """While the block runs, sample the main thread's stack, and count the samples of each part.

    A function in a file that belongs to no part, for example of another package, counts for the
    part that called the function.
    """
    counts: Counter[str] = Counter()
    part_by_file: dict[str, str | None] = {}

    def count_sample(_signal: int, frame: FrameType | None) -> None:
        while frame is not None:
            file = frame.f_code.co_filename
            if file not in part_by_file:
                part_by_file[file] = _part_of(file)
            if part := part_by_file[file]:
                counts[part] += 1
                return
            frame = frame.f_back
        counts[_OTHER_CODE] += 1

    previous_handler = signal.signal(signal.SIGPROF, count_sample)
    signal.setitimer(signal.ITIMER_PROF, SAMPLE_PERIOD_S, SAMPLE_PERIOD_S)
    try:
        yield counts
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, previous_handler)


def shares(counts: Counter[str]) -> dict[str, float]:
    """Share of each part in all samples, largest first; the sum is 1."""
    total = counts.total()
    return {part: count / total for part, count in counts.most_common()}


def _part_of(file: str) -> str | None:
    """The part to which a source file belongs; None if no part names it."""
    for root in _SOURCE_ROOTS:
        name = file.removeprefix(root)
        for part, prefixes in PROGRAM_PARTS.items():
            if name.startswith(prefixes):
                return part
    return None
