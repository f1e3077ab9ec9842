"""Monitors of other packages: they run beside our monitors, and cannot disable or weaken ours.

The check of a monitor is its function that looks for a breach in each snapshot. Each monitor has
three rows in the table: the monitor itself, one for exceptions of its check, and one for the time
that the check takes. A check that raises is not called again, and the vehicle is handed back,
because the flight must not go on without a monitor that the user wanted. A slow check delays
the answers to samples, and a warning names it.
"""

from dataclasses import replace
from time import perf_counter

from companion import plugins
from companion.config import Config
from companion.files.yaml_file import ConfigError
from companion.safety.actions import Action, StreamEffect
from companion.safety.monitor import Monitor, with_hysteresis
from companion.safety.snapshot import Snapshot
from companion.user_code import UserCodeError, naming_user_code

_ALLOWED_ACTIONS = (Action.WARN, Action.HOLD, Action.HAND_BACK, Action.LAND)
"""The actions that a monitor of another package may have."""
_ALLOWED_ACTIONS_AFTER_HOLD = (Action.HAND_BACK, Action.LAND)
_MAX_CHECK_DURATION = 0.003
"""Longest time that a check may take, s: a sample comes every 4 ms, and must be answered."""
_SLOW_DURATION = 0.5
"""Time for which every call of a check must be too slow before the warning, s; a busy computer
makes only some calls slow."""


def plugin_monitors(config: Config) -> tuple[Monitor, ...]:
    """The monitors that `safety.monitors` names, three rows for each.

    Raises:
        ConfigError: a monitor cannot be loaded or made, or its check fails on a snapshot in which
            nothing is known.
    """
    return tuple(row for name in config.safety.monitors for row in _monitors_named(name, config))


def _monitors_named(name: str, config: Config) -> tuple[Monitor, ...]:
    setting = f"safety.monitors: {name}"
    try:
        factory = plugins.load(plugins.MONITORS, name)
        with naming_user_code("monitor", factory):
            monitor = factory(config)
    except (plugins.PluginError, UserCodeError) as error:
        raise ConfigError(f"{setting}: {error}") from error
    if not isinstance(monitor, Monitor):
        raise ConfigError(
            f"{setting} must make a companion.safety.monitor.Monitor, not {monitor!r}"
        )
    if (
        monitor.action not in _ALLOWED_ACTIONS
        or monitor.action_after_hold not in _ALLOWED_ACTIONS_AFTER_HOLD
    ):
        raise ConfigError(
            f"{setting}: `action` must be WARN, HOLD, HAND_BACK or LAND, and "
            "`action_after_hold` must be HAND_BACK or LAND"
        )
    guarded_check = GuardedCheck(monitor)
    guarded_check.check(Snapshot(0.0), False)
    if guarded_check.fault is not None:
        raise ConfigError(
            f"{setting} must accept a snapshot whose values are None: {guarded_check.fault}"
        )
    guarded_monitor = replace(
        monitor, name=name, check=guarded_check.check, stream=StreamEffect.CONTINUES
    )
    return (
        guarded_monitor,
        replace(
            guarded_monitor,
            name=f"{name} (error)",
            check=guarded_check.breach_of_fault,
            action=Action.HAND_BACK,
            raise_after=0.0,
        ),
        replace(
            guarded_monitor,
            name=f"{name} (too slow)",
            check=guarded_check.breach_of_time,
            action=Action.WARN,
            raise_after=_SLOW_DURATION,
        ),
    )


class GuardedCheck:
    """Calls the check of another package until the check fails.

    Attributes:
        fault: how the check failed, or None.
    """

    def __init__(self, monitor: Monitor) -> None:
        self.fault: str | None = None
        self._check = monitor.check
        self._check_duration = 0.0

    def check(self, snapshot: Snapshot, raised: bool) -> str | None:
        """The breach that the check reports; None after its first fault."""
        if self.fault is not None:
            return None
        start_time = perf_counter()
        try:
            with naming_user_code("check", self._check):
                breach = self._check(snapshot, raised)
                if breach is not None and not (isinstance(breach, str) and breach.strip()):
                    raise TypeError(f"it returned {breach!r}, which is neither a text nor None")
                return breach
        except UserCodeError as error:
            self.fault = str(error)
            return None
        finally:
            self._check_duration = perf_counter() - start_time

    def breach_of_fault(self, snapshot: Snapshot, raised: bool) -> str | None:
        """A breach if the check itself has failed."""
        return None if self.fault is None else f"{self.fault}; the vehicle is handed back"

    def breach_of_time(self, snapshot: Snapshot, raised: bool) -> str | None:
        """A breach if the latest call of the check took too long; None after the check's fault."""
        if self.fault is not None or self._check_duration <= with_hysteresis(
            _MAX_CHECK_DURATION, raised
        ):
            return None
        return f"this monitor takes {1e3 * self._check_duration:.0f} ms, and delays the setpoints"
