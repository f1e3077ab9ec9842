"""Planners, guidance and monitors of other packages, found by their entry points."""

from collections.abc import Sequence
from importlib.metadata import EntryPoint, entry_points
from typing import Any

PLANNERS = "companion.planners"
"""Entry points of planners: a law (`companion.attitude.Law`), or a class of planners with one
argument, `companion.attitude.Constants`.
"""
GUIDANCE = "companion.guidance"
"""Entry points of guidance: a class with the Protocol `companion.guidance.linear.Guidance` and one
argument, `LinearSettings`.
"""
MONITORS = "companion.monitors"
"""Entry points of monitors: a function of the configuration (`companion.config.Config`) that makes
a `companion.safety.monitor.Monitor`.
"""


class PluginError(Exception):
    """A plug-in is not installed or cannot be loaded; the message names it and the reason."""


def names(group: str) -> tuple[str, ...]:
    """The names of the installed plug-ins of a group, sorted."""
    return tuple(sorted({each.name for each in entry_points(group=group)}))


def load(group: str, name: str) -> Any:
    """The object that an entry point names.

    Raises:
        PluginError: there is no such plug-in, two packages provide it, or its import fails.
    """
    matches = tuple(entry_points(group=group, name=name))
    if len(matches) != 1:
        raise PluginError(_match_count_message(group, name, matches))
    try:
        return matches[0].load()
    except Exception as error:
        raise PluginError(
            f"the plug-in {name!r} ({_entry_point_source(matches[0])}) cannot be loaded: {error!r}"
        ) from error


def _match_count_message(group: str, name: str, matches: Sequence[EntryPoint]) -> str:
    if matches:
        sources = " and ".join(map(_entry_point_source, matches))
        return f"{sources} both give a plug-in {name!r}; uninstall one"
    return f"no plug-in {name!r} in {group}; installed: {', '.join(names(group)) or 'none'}"


def _entry_point_source(entry_point: EntryPoint) -> str:
    package = entry_point.dist.name if entry_point.dist is not None else "an unknown package"
    return f"{entry_point.value} of {package}"
