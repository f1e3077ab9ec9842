"""What can be fuzzed: where cases come from, how one is judged, and a watchdog over each."""

import json
import resource
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import psutil
from hypothesis.strategies import SearchStrategy

CORPUS = Path(__file__).parent / "corpus"
"""Cases that once failed, one JSON file each, in a folder for each target."""

WALL_FACTOR = 10.0
"""A case may take this many times its processor time on the clock: others use the machine, too."""

_AGAIN_S = 0.1
"""After an alarm that was lost the next one comes so soon."""

MEMORY_BYTES = 1 << 30
"""A case may add this much to the addresses that the process has; more is a `MemoryError`."""

Case = Any
"""Lists, dicts, text, numbers and None: what JSON holds, so that a case is a file."""


@dataclass(frozen=True)
class Target:
    """One thing to fuzz.

    Attributes:
        name: its name, and that of its folder in the corpus.
        cases: makes cases.
        check: raises what is wrong with the program, if anything is.
        seconds: processor time that one case may take.
    """

    name: str
    cases: SearchStrategy[Case]
    check: Callable[[Case], None]
    seconds: float = 2.0

    def run(self, case: Case) -> None:
        """Check one case; raises `HungError` if that does not end in time."""
        with bounded_memory(), watchdog(self.seconds):
            self.check(case)

    def corpus(self) -> list[Path]:
        """Files of the cases that once failed."""
        return sorted((CORPUS / self.name).glob("*.json"))


class HungError(AssertionError):
    """A case took too long."""


class _Alarm(BaseException):
    """From the signal handler: no `except Exception` on the way may stop it."""


@contextmanager
def watchdog(seconds: float) -> Iterator[None]:
    """End what takes more than `seconds` of processor time, or waits for ten times as long.

    Raises:
        HungError: it did, with the place where.
    """

    def ring(_number: int, frame: Any) -> None:
        # What a callback of the garbage collector raises is lost; the next alarm is not.
        if frame is None or frame.f_code.co_name != "gc_callback":
            raise _Alarm

    clocks = {
        signal.SIGPROF: (signal.ITIMER_PROF, seconds),
        signal.SIGALRM: (signal.ITIMER_REAL, seconds * WALL_FACTOR),
    }
    handlers = {number: signal.signal(number, ring) for number in clocks}
    began = time.monotonic()
    # pytest-timeout counts by ITIMER_REAL, too; it gets back what it had left.
    left = {timer: signal.setitimer(timer, limit, _AGAIN_S)[0] for timer, limit in clocks.values()}
    try:
        yield
    except _Alarm as alarm:
        limits = f"{seconds:g} s of processor time or {seconds * WALL_FACTOR:g} s"
        raise HungError(f"took more than {limits}") from alarm
    finally:
        for timer, seconds_left in left.items():
            still = max(_AGAIN_S, seconds_left - (time.monotonic() - began))
            signal.setitimer(timer, still if seconds_left else 0.0)
        for number, handler in handlers.items():
            signal.signal(number, handler)


@contextmanager
def bounded_memory() -> Iterator[None]:
    """Let what runs inside take `MEMORY_BYTES` and no more."""
    before = resource.getrlimit(resource.RLIMIT_AS)
    size = psutil.Process().memory_info().vms + MEMORY_BYTES
    hard = before[1]
    resource.setrlimit(resource.RLIMIT_AS, (size if hard < 0 else min(size, hard), hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, before)


def read_case(path: Path) -> Case:
    """The case in a file of the corpus."""
    return json.loads(path.read_text(encoding="utf-8"))


def case_text(case: Case) -> str:
    """A case as the text of its file."""
    return json.dumps(case, indent=1) + "\n"
