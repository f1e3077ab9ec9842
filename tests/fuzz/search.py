"""Tries cases of a target until time is over, and makes each failure small."""

import faulthandler
import re
import time
import traceback
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from hypothesis import HealthCheck, Phase, Verbosity, given, seed, settings
from hypothesis.errors import HypothesisException

from tests.fuzz.target import WALL_FACTOR, Case, Target, case_text

_BATCH = 400
"""Cases after which hypothesis begins with a new seed."""
_SHRINKING_S = 20.0
"""A failure is made smaller for this long."""
_FOLDERS = re.compile(r"/tmp/fuzz-\w+/")
"""Which a case's files are put to, another one each time."""
_NUMBERS = re.compile(r"-?(0x)?[0-9a-f.]*[0-9][0-9a-f.]*")


class _Over(BaseException):
    """The time is over."""


@dataclass
class Search:
    """One target's share of a run.

    Attributes:
        target: what is fuzzed.
        running: file of the case that is being tried.
        cases: how many were tried.
        slowest: processor time of the slowest that was not ended, s.
        failures: the smallest case and the error of each kind of failure.
    """

    target: Target
    running: Path
    cases: int = 0
    slowest: float = 0.0
    failures: dict[str, tuple[Case, BaseException]] = field(default_factory=dict)
    _until: float = 0.0
    _current: str | None = None
    _shrinks_until: float = 0.0

    def run(self, seconds: float, first_seed: int) -> None:
        """Try cases for this long; on with other seeds after each failure."""
        self._until = time.monotonic() + seconds
        for number in _from(first_seed):
            self._current = None
            try:
                self._batch(number)
            except _Over:
                return
            except (Exception, HypothesisException, BaseExceptionGroup):
                continue  # it is in `failures`

    def _batch(self, number: int) -> None:
        @seed(number)
        @settings(
            max_examples=_BATCH,
            database=None,
            deadline=None,
            derandomize=False,
            phases=(Phase.generate, Phase.target, Phase.shrink),
            suppress_health_check=list(HealthCheck),
            report_multiple_bugs=False,
            verbosity=Verbosity.quiet,
        )
        @given(self.target.cases)
        def search(case: Case) -> None:
            self._try(case)

        search()

    def _try(self, case: Case) -> None:
        if time.monotonic() > self._until and self._current is None:
            raise _Over
        smallest = self._current and self.failures[self._current][0] == case
        if self._current and not smallest and time.monotonic() > self._shrinks_until:
            return  # small enough
        self.cases += 1
        began = time.process_time()
        # A loop in C hears no alarm: then the program ends, and the case stands in `running`.
        self.running.write_text(case_text(case), encoding="utf-8")
        faulthandler.dump_traceback_later(2.0 * WALL_FACTOR * self.target.seconds, exit=True)
        try:
            self.target.run(case)
        except Exception as error:
            self._note(case, error)
        else:
            self.slowest = max(self.slowest, time.process_time() - began)
        finally:
            faulthandler.cancel_dump_traceback_later()

    def _note(self, case: Case, error: Exception) -> None:
        """Keep a failure, and raise it if it is the one that is being made smaller."""
        kind = kind_of(error)
        if self._current is None and kind not in self.failures:
            self._current, self._shrinks_until = kind, time.monotonic() + _SHRINKING_S
        if kind != self._current:
            self.failures.setdefault(kind, (case, error))
            return
        self.failures[kind] = (case, error)
        raise error


def kind_of(error: BaseException) -> str:
    """What two failures with one cause have in common: the error and where it was raised."""
    origin = error
    while origin.__cause__ is not None:
        origin = origin.__cause__
    frames = traceback.extract_tb(origin.__traceback__)
    ours = [frame for frame in frames if "companion/" in frame.filename] or frames
    places = {f"{Path(frame.filename).name}:{frame.lineno}" for frame in (ours[-1], frames[-1])}
    words = _NUMBERS.sub("#", _FOLDERS.sub("", str(error)))[:60]
    return f"{type(error).__name__} at {' and '.join(sorted(places))}: {words}"


def save(search: Search, folder: Path) -> Iterator[Path]:
    """Write each failure's case as a file of the corpus, and its traceback beside it."""
    here = folder / search.target.name
    here.mkdir(parents=True, exist_ok=True)
    for case, error in search.failures.values():
        text = case_text(case)
        path = here / f"{type(error).__name__.lower()}-{hash_of(text):08x}.json"
        path.write_text(text, encoding="utf-8")
        lines: list[Any] = traceback.format_exception(error)
        path.with_suffix(".txt").write_text("".join(lines), encoding="utf-8", errors="replace")
        yield path


def hash_of(text: str) -> int:
    """A number for a text that is the same in every run."""
    return zlib.crc32(text.encode())


def _from(number: int) -> Iterator[int]:
    while True:
        yield number
        number += 1
