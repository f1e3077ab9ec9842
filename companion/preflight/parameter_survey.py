"""Reads from a vehicle the parameters that matter to a flight."""

import asyncio
from collections.abc import Iterable, Mapping
from typing import NamedTuple

from companion.mavlink.errors import ParameterRefused, UnansweredParameter, UnknownParameter
from companion.mavlink.stats import TOLERABLE_LOSS, share_lost
from companion.vehicle.link import Link
from companion.vehicle.parameter_rules import ParameterRule, Values

_MAX_OPEN_REQUESTS = 8
"""Number of parameter requests under way at a time. ArduPilot queues 20 and drops the rest. At
57600 baud eight requests take about 40 ms, their answers 50 ms.
"""


class RetryPolicy(NamedTuple):
    """How often and at which interval a parameter is requested."""

    timeout_s: float
    """Time until a request is repeated, s."""
    tries: int
    """Number of requests for each name; a parameter may have an old name, too."""


_FIRST_ROUND = RetryPolicy(0.5, 3)
"""First round. Old versions of PX4 do not answer for a parameter that they lack, so each missing
parameter costs 1.5 s.
"""
_SECOND_ROUND = RetryPolicy(0.75, 6)
"""Second round. If each direction loses one frame in five, 5 % of the parameters get no answer to
the first three requests, and 0.01 % get none after six more.
"""


class Survey(NamedTuple):
    """The parameters that were read, without those that the autopilot lacks."""

    values: Values
    """Values by newest name."""
    present_names: Mapping[str, str]
    """Name of each parameter in this autopilot, by newest name."""
    unread_names: frozenset[str] = frozenset()
    """Newest names of the parameters that were not read, although the autopilot may have them: it
    did not report them as unknown."""
    link_loses_frames: bool = False
    """Whether the link lost frames during the survey, in either direction."""


async def survey_parameters(
    link: Link, rules: Iterable[ParameterRule], *, earlier_survey: Survey | None = None
) -> Survey:
    """Read the rules' parameters, several at a time; ask again if the link loses frames.

    An old name is requested only if the new one gave no value. Parameters without any answer are
    requested in a second round, for longer, but only if the link loses frames and at least one
    parameter was answered. Without losses, no answer means that the autopilot lacks the parameter.

    `earlier_survey`: survey of the same vehicle. Parameters without a value in it are not requested
    again, because each costs seconds on a link that loses frames.

    Raises:
        LinkLost: the connection was lost.
    """
    rules, requests = tuple(rules), _Requests(link)
    unread_names: frozenset[str] = frozenset()
    if earlier_survey is not None:
        unread_names = earlier_survey.unread_names
        rules = tuple(rule for rule in rules if rule.name in earlier_survey.values)
        requests.skip_names(
            name
            for rule in rules
            for name in rule.names
            if name != earlier_survey.present_names[rule.name]
        )
    await requests.request(rules, _FIRST_ROUND)
    # An autopilot that answered nothing at all is a finding of its own.
    if requests.values and requests.link_loses_frames:
        await requests.request(requests.unread_rules(rules), _SECOND_ROUND)
    return Survey(
        requests.values,
        requests.present_names,
        unread_names.union(rule.name for rule in requests.unread_rules(rules)),
        requests.link_loses_frames,
    )


class _Requests:
    """The parameter requests to a vehicle, and its answers.

    Attributes:
        values, present_names: see `Survey`.
    """

    def __init__(self, link: Link) -> None:
        self.values: dict[str, float] = {}
        self.present_names: dict[str, str] = {}
        self._link = link
        self._frames_before, self._lost_frames_before = link.stats.frames, link.stats.lost
        self._request_slots = asyncio.Semaphore(_MAX_OPEN_REQUESTS)
        self._skipped_names: set[str] = set()
        self._request_was_repeated = False

    @property
    def link_loses_frames(self) -> bool:
        """Whether more than `TOLERABLE_LOSS` of the frames were lost, or a request was repeated.

        Gaps in sequence numbers show lost frames of the vehicle. An answer to a repeated request
        shows that the earlier request or its answer was lost.
        """
        stats = self._link.stats
        lost_share = share_lost(
            stats.frames - self._frames_before, stats.lost - self._lost_frames_before
        )
        return self._request_was_repeated or lost_share > TOLERABLE_LOSS

    def skip_names(self, names: Iterable[str]) -> None:
        """Do not request these names, because this autopilot uses other names."""
        self._skipped_names.update(names)

    def unread_rules(self, rules: Iterable[ParameterRule]) -> list[ParameterRule]:
        """The rules of the parameters that were not read and not reported as unknown."""
        return [
            rule
            for rule in rules
            if rule.name not in self.values and not self._skipped_names.issuperset(rule.names)
        ]

    async def request(self, rules: Iterable[ParameterRule], policy: RetryPolicy) -> None:
        """Request all of these parameters. Raises `LinkLost`."""
        await asyncio.gather(*(self._request_under_each_name(rule, policy) for rule in rules))

    async def _request_under_each_name(self, rule: ParameterRule, policy: RetryPolicy) -> None:
        async with self._request_slots:
            for name in rule.names:
                value = (
                    None if name in self._skipped_names else await self._read_value(name, policy)
                )
                if value is not None:
                    self.values[rule.name], self.present_names[rule.name] = value, name
                    return

    async def _read_value(self, name: str, policy: RetryPolicy) -> float | None:
        for attempt in range(policy.tries):
            try:
                value = await self._link.read_parameter(name, timeout_s=policy.timeout_s, retries=0)
            except UnansweredParameter:
                continue
            except UnknownParameter:
                self._skipped_names.add(name)
                return None
            except ParameterRefused:
                return None
            self._request_was_repeated = self._request_was_repeated or attempt > 0
            return float(value)
        return None
