"""One row of a table: what the vehicle does when, and what must hold then."""

from collections.abc import Callable, Mapping
from typing import NamedTuple

import pytest

from tests.hostile.flying import fly, fly_over_sockets
from tests.hostile.judge import judge
from tests.hostile.personality import BOTH, Personality


class Scenario(NamedTuple):
    """A flight with what goes wrong in it.

    Attributes:
        name: a sentence a pilot understands.
        script: (mark, delay in s, action) each; see `autopilot.HostileAutopilot`.
        demands: of `endings`, on top of the rules of `judge`.
        kinds: the personalities that are concerned.
        slow_on: of these, one that only `make test-all` flies.
        mode: in which the vehicle begins.
        rules: keywords of `judge`.
        changes: to the configuration.
        over_sockets: fly it over UDP, because its ports matter.
    """

    name: str
    script: tuple
    demands: tuple[Callable, ...]
    kinds: tuple = BOTH
    slow_on: Personality | None = None
    mode: str | None = None
    rules: Mapping[str, bool] = {}
    changes: Mapping[str, object] = {}
    over_sockets: bool = False

    def fly(self, kind, folder):
        """Fly it, and hold it to the rules and to its demands."""
        take_off = fly_over_sockets if self.over_sockets else fly
        flown = take_off(kind, self.script, folder, mode=self.mode, **self.changes)
        judge(flown, **self.rules)
        for demand in self.demands:
            demand(flown)
        return flown


def in_turn(rows_of):
    """The rows of both personalities; `make test` flies each on one of them, in turn.

    Args:
        rows_of: personality → its rows.
    """
    for offset, kind in enumerate(BOTH):
        for number, row in enumerate(rows_of(kind)):
            yield row._replace(slow_on=kind) if (number + offset) % 2 else row


def flights(rows):
    """Parametrize a test by (scenario, kind)."""
    params = []
    for row in rows:
        for kind in row.kinds:
            name = f"{kind.name}: {row.name}"
            marks = [pytest.mark.slow] if kind is row.slow_on else []
            params.append(pytest.param(row, kind, id=name, marks=marks))
    return pytest.mark.parametrize(("scenario", "kind"), params)
