"""Reading the parameters that matter from a vehicle."""

import asyncio
from collections.abc import Iterable, Mapping
from typing import NamedTuple

from companion.mavlink.errors import ParameterRefused, UnknownParameter
from companion.mavlink.link import Link
from companion.mavlink.parameter_rules import ParameterRule, Values

_AT_ONCE = 8
"""So many questions under way are in nobody's way: ArduPilot queues 20 and drops the rest, and at
57600 baud they take 30 ms."""


class Survey(NamedTuple):
    """What was read; parameters that the autopilot has under none of their names are left out.

    Attributes:
        values: By the newest name.
        names: By the newest name, the one that this autopilot knows.
    """

    values: Values
    names: Mapping[str, str]


async def survey(
    link: Link, rules: Iterable[ParameterRule], *, timeout_s: float = 0.5, retries: int = 2
) -> Survey:
    """Read the rules' parameters, several at a time.

    An autopilot may say nothing of a parameter that it has not (older PX4 does not), so an old name
    is asked for only where the new one got no answer, and each such question takes
    `timeout_s` · (`retries` + 1) in s.

    Raises:
        LinkLost: The connection dropped meanwhile.
    """
    free = asyncio.Semaphore(_AT_ONCE)

    async def read(rule: ParameterRule) -> tuple[str, float] | None:
        async with free:
            for name in rule.names:
                try:
                    value = await link.read_parameter(name, timeout_s=timeout_s, retries=retries)
                except (ParameterRefused, UnknownParameter):
                    continue
                return name, float(value)
        return None

    rules = tuple(rules)
    answers = await asyncio.gather(*(read(rule) for rule in rules))
    known = {
        rule.name: answer for rule, answer in zip(rules, answers, strict=True) if answer is not None
    }
    return Survey(
        {name: value for name, (_, value) in known.items()},
        {name: actual for name, (actual, _) in known.items()},
    )
