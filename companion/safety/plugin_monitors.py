"""Monitors of other packages: they run beside ours, and cannot stop or soften them.

Each stands in the table three times: as it was made, as a monitor of its own faults, and as one of
the time it takes. A judge that raises is not asked again, and the vehicle is handed back: a flight
that was to be watched must not go on unwatched. A slow judge delays the answers to samples, and a
warning names it.
"""

from collections.abc import Callable
from dataclasses import replace
from time import perf_counter

from companion import plugins
from companion.config import Config
from companion.files.yaml_file import ConfigError
from companion.safety.actions import Action, Stream
from companion.safety.monitor import Monitor, with_hysteresis
from companion.safety.snapshot import Snapshot
from companion.user_code import UserCodeError, naming_user_code

_ACTIONS = (Action.WARN, Action.HOLD, Action.HAND_BACK, Action.LAND)
"""The actions that a monitor of another package may have."""
_AFTER_HOLD = (Action.HAND_BACK, Action.LAND)
_SLOW = 0.003
"""A judge that takes longer is slow, s: a sample comes every 4 ms, and must be answered."""
_SLOW_FOR = 0.5
"""Time for which every answer must be slow before the warning, s; a busy computer is quicker now
and then."""

MonitorFactory = Callable[[Config], Monitor]
"""What an entry point in `companion.monitors` names: makes a monitor for a configuration."""


def plugin_monitors(config: Config) -> tuple[Monitor, ...]:
    """The monitors that `safety.monitors` names, three rows for each.

    Raises:
        ConfigError: one cannot be loaded or made, or its judge fails on a snapshot in which nothing
            is known.
    """
    return tuple(row for name in config.safety.monitors for row in _rows(name, config))


def _rows(name: str, config: Config) -> tuple[Monitor, ...]:
    where = f"safety.monitors: {name}"
    try:
        factory = plugins.load(plugins.MONITORS, name)
        with naming_user_code("monitor", factory):
            monitor = factory(config)
    except (plugins.PluginError, UserCodeError) as error:
        raise ConfigError(f"{where}: {error}") from error
    if not isinstance(monitor, Monitor):
        raise ConfigError(f"{where} made no companion.safety.monitor.Monitor but {monitor!r}")
    if monitor.action not in _ACTIONS or monitor.then not in _AFTER_HOLD:
        raise ConfigError(
            f"{where}: its action must be WARN, HOLD, HAND_BACK or LAND, and what follows a hold "
            "HAND_BACK or LAND"
        )
    guarded = GuardedJudge(monitor)
    guarded.judge(Snapshot(0.0), False)
    if guarded.fault is not None:
        raise ConfigError(f"{where} cannot be used where a value is not known: {guarded.fault}")
    return (
        replace(monitor, name=name, judge=guarded.judge, stream=Stream.CONTINUES),
        replace(
            monitor,
            name=f"{name} (its fault)",
            judge=guarded.judge_fault,
            action=Action.HAND_BACK,
            lasts=0.0,
            stream=Stream.CONTINUES,
        ),
        Monitor(f"{name} (its time)", guarded.judge_time, Action.WARN, lasts=_SLOW_FOR),
    )


class GuardedJudge:
    """Asks the judge of another package until it fails.

    Attributes:
        fault: how the judge failed, or None.
    """

    def __init__(self, monitor: Monitor) -> None:
        self.fault: str | None = None
        self._judge = monitor.judge
        self._taken = 0.0

    def judge(self, snapshot: Snapshot, raised: bool) -> str | None:
        """What the judge returns; None from its first fault on."""
        if self.fault is not None:
            return None
        began = perf_counter()
        try:
            with naming_user_code("judge", self._judge):
                breach = self._judge(snapshot, raised)
                if breach is not None and not (isinstance(breach, str) and breach.strip()):
                    raise TypeError(f"it returned {breach!r}, which is neither a text nor None")
                return breach
        except UserCodeError as error:
            self.fault = str(error)
            return None
        finally:
            self._taken = perf_counter() - began

    def judge_fault(self, snapshot: Snapshot, raised: bool) -> str | None:
        """The fault of the judge as a breach."""
        return None if self.fault is None else f"{self.fault}; the vehicle is handed back"

    def judge_time(self, snapshot: Snapshot, raised: bool) -> str | None:
        """A breach if the judge's latest answer took too long."""
        if self._taken <= with_hysteresis(_SLOW, raised):
            return None
        return f"it takes {1e3 * self._taken:.0f} ms to judge, and delays the setpoints"
