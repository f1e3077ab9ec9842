"""Fuzz all targets in turn: `nice -n 19 python -m tests.fuzz --minutes 60`.

Each failure is made small and written as a file; moved into `tests/fuzz/corpus`, it is a test.
Exit code 1 if anything failed.
"""

import argparse
import faulthandler
import secrets
import sys
import tempfile
import warnings
from pathlib import Path

from hypothesis.errors import HypothesisWarning

from tests.fuzz.search import Search, save
from tests.fuzz.targets import TARGETS

_ROUND_S = 60.0
"""A target's turn, at most."""


def main() -> int:
    """Fuzz and report."""
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--seed", type=int, default=None, help="default: another each time")
    parser.add_argument("--target", choices=TARGETS, action="append", help="only this one")
    parser.add_argument("--out", type=Path, help="folder for failures; default: a new one")
    options = parser.parse_args()
    faulthandler.enable()
    warnings.filterwarnings("ignore", category=HypothesisWarning)  # of long cases
    seed = secrets.randbits(32) if options.seed is None else options.seed
    out = options.out or Path(tempfile.mkdtemp(prefix="fuzz-found-"))
    out.mkdir(parents=True, exist_ok=True)
    running = out / "running.json"
    searches = [Search(TARGETS[name], running) for name in options.target or TARGETS]
    seconds = 60.0 * options.minutes / len(searches)
    rounds = max(1, round(seconds / _ROUND_S))
    print(f"seed {seed}, failures go to {out}", flush=True)
    for turn in range(rounds):
        for search in searches:
            search.run(seconds / rounds, seed + turn * 1_000_000)
            for path in save(search, out):
                print(f"failed: {path}", flush=True)
    _report(searches, seconds, seed)
    return 1 if any(search.failures for search in searches) else 0


def _report(searches: list[Search], seconds: float, seed: int) -> None:
    heads = ("minutes", "cases", "cases/s", "slowest s", "failed")
    print(f"\n{'target':<16}" + "".join(f"{head:>11}" for head in heads))
    for search in searches:
        print(
            f"{search.target.name:<16}{seconds / 60:>11.1f}{search.cases:>11}"
            f"{search.cases / seconds:>11.1f}{search.slowest:>11.2f}{len(search.failures):>11}"
        )
    print(f"seed {seed}, {sum(search.cases for search in searches)} cases")
    for search in searches:
        for kind in search.failures:
            print(f"  {search.target.name}: {kind}")


if __name__ == "__main__":
    sys.exit(main())
