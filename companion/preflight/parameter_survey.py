"""Reading the parameters that matter from a vehicle."""

import asyncio
from collections.abc import Iterable, Mapping
from typing import NamedTuple

from companion.mavlink.errors import ParameterRefused, UnansweredParameter, UnknownParameter
from companion.mavlink.stats import SOME_LOST, share_lost
from companion.vehicle.link import Link
from companion.vehicle.parameter_rules import ParameterRule, Values

_AT_ONCE = 8
"""So many questions under way are in nobody's way: ArduPilot queues 20 and drops the rest, and at
57600 baud they take 30 ms."""


class Patience(NamedTuple):
    """For how long one parameter is asked for.

    Attributes:
        timeout_s: Until a question is repeated, s.
        tries: So many questions under each of its names.
    """

    timeout_s: float
    tries: int


_AT_FIRST = Patience(0.5, 3)
"""An autopilot may say nothing of a parameter that it has not, as older PX4: each costs 1.5 s."""
_ONCE_MORE = Patience(0.75, 6)
"""Where one frame in five is lost either way, three questions of a hundred get no answer to the
first three and these six would leave one of ten thousand."""


class Survey(NamedTuple):
    """What was read; parameters that the autopilot has under none of their names are left out.

    Attributes:
        values: By the newest name.
        names: By the newest name, the one that this autopilot knows.
        untold: Newest names of those for which neither a value came nor the word that it has none.
        lossy: Whether the link lost frames meanwhile, the vehicle's or ours.
    """

    values: Values
    names: Mapping[str, str]
    untold: frozenset[str] = frozenset()
    lossy: bool = False


async def survey(
    link: Link,
    rules: Iterable[ParameterRule],
    *,
    before: Survey | None = None,
    at_first: Patience = _AT_FIRST,
    once_more: Patience = _ONCE_MORE,
) -> Survey:
    """Read the rules' parameters, several at a time; where the link loses frames, ask again.

    An old name is asked for only where the new one got no answer. What got none at all is asked for
    once more, after all others and longer, but only where frames were lost: on a good link it is
    what this autopilot has not, and the question costs time alone.

    Args:
        link: To the vehicle.
        rules: Of its family.
        before: What the same vehicle said before: what it did not tell then is not asked again, for
            that costs seconds each time on a link that loses frames.
        at_first: For the first question.
        once_more: For the second.

    Raises:
        LinkLost: The connection dropped meanwhile.
    """
    rules, questions = tuple(rules), _Questions(link)
    untold: frozenset[str] = frozenset()
    if before is not None:
        untold = before.untold
        rules = tuple(rule for rule in rules if rule.name in before.values)
        questions.leave_out(
            name for rule in rules for name in rule.names if name != before.names[rule.name]
        )
    await questions.ask(rules, at_first)
    # Who answered nothing at all will not do so now, and that is a finding of its own.
    if questions.values and questions.lossy:
        await questions.ask(questions.untold(rules), once_more)
    return Survey(
        questions.values,
        questions.names,
        untold.union(rule.name for rule in questions.untold(rules)),
        questions.lossy,
    )


class _Questions:
    """What was asked of a vehicle, and what it said.

    Attributes:
        values, names: As in `Survey`.
    """

    def __init__(self, link: Link) -> None:
        self.values: dict[str, float] = {}
        self.names: dict[str, str] = {}
        self._link = link
        self._frames, self._lost = link.stats.frames, link.stats.lost
        self._free = asyncio.Semaphore(_AT_ONCE)
        self._none: set[str] = set()
        self._repeated = False

    @property
    def lossy(self) -> bool:
        """Whether frames of the vehicle are missing, or ours by an answer only to a repetition."""
        stats = self._link.stats
        lost = share_lost(stats.frames - self._frames, stats.lost - self._lost)
        return self._repeated or lost > SOME_LOST

    def leave_out(self, names: Iterable[str]) -> None:
        """The autopilot is known to have none of these names."""
        self._none.update(names)

    def untold(self, rules: Iterable[ParameterRule]) -> list[ParameterRule]:
        """Of the rules those without a value, unless the autopilot said that it has none."""
        return [
            rule
            for rule in rules
            if rule.name not in self.values and not self._none.issuperset(rule.names)
        ]

    async def ask(self, rules: Iterable[ParameterRule], patience: Patience) -> None:
        """Ask for all of them; raises `LinkLost`."""
        await asyncio.gather(*(self._ask_under_each_name(rule, patience) for rule in rules))

    async def _ask_under_each_name(self, rule: ParameterRule, patience: Patience) -> None:
        async with self._free:
            for name in rule.names:
                value = None if name in self._none else await self._value(name, patience)
                if value is not None:
                    self.values[rule.name], self.names[rule.name] = value, name
                    return

    async def _value(self, name: str, patience: Patience) -> float | None:
        for attempt in range(patience.tries):
            try:
                value = await self._link.read_parameter(
                    name, timeout_s=patience.timeout_s, retries=0
                )
            except UnansweredParameter:
                continue
            except UnknownParameter:
                self._none.add(name)
                return None
            except ParameterRefused:
                return None
            self._repeated = self._repeated or attempt > 0
            return float(value)
        return None
