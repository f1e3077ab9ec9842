"""Reading the parameters that matter from a vehicle."""

from collections.abc import Iterable

from companion.mavlink.errors import UnknownParameter
from companion.mavlink.link import Link
from companion.mavlink.parameter_rules import ParameterRule


async def survey(
    link: Link, rules: Iterable[ParameterRule], *, timeout_s: float = 1.0, retries: int = 3
) -> dict[str, float]:
    """The values of the rules' parameters, under their newest names.

    An autopilot may say nothing of a parameter that it has not (PX4 does not), so an old name is
    asked for only where the new one got no answer, and each such question takes
    `timeout_s` · (`retries` + 1) in s. What it has under none of its names is left out.

    Raises:
        LinkLost: The connection dropped meanwhile.
    """
    values: dict[str, float] = {}
    for rule in rules:
        for name in rule.names:
            try:
                value = await link.read_parameter(name, timeout_s=timeout_s, retries=retries)
            except UnknownParameter:
                continue
            values[rule.name] = float(value)
            break
    return values
