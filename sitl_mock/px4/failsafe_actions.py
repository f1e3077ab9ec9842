"""The actions of PX4's failsafes, their parameters and causes (source: PX4's failsafe)."""

import struct
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum
from typing import NamedTuple

from sitl_mock.autopilot.events import EventKind
from sitl_mock.autopilot.parameters import ParameterTable
from sitl_mock.autopilot.state import Mode, State
from sitl_mock.px4.event_log import Announcer
from sitl_mock.px4.modes import POSITION_MODES, custom_mode

_ENTER_HOLD_LAYOUT = struct.Struct("<IBHB")
_ENTER_LAYOUT = struct.Struct("<IBB")


class Action(NamedTuple):
    """Action of a failsafe: its number in PX4's events, and its mode (None: motors off)."""

    number: int
    mode: Mode | None


POSITION, ALTITUDE = Action(2, Mode.POSCTL), Action(3, Mode.ALTCTL)
STABILIZED = Action(4, Mode.STABILIZED)
HOLD, RETURN, LAND = Action(5, Mode.LOITER), Action(6, Mode.RTL), Action(7, Mode.LAND)
DISARM, TERMINATE = Action(9, None), Action(10, None)

OFFBOARD_ACTIONS = {
    0: POSITION,
    1: ALTITUDE,
    2: STABILIZED,
    3: RETURN,
    4: LAND,
    5: HOLD,
    6: TERMINATE,
    7: DISARM,
}
"""COM_OBL_RC_ACT -> action; without a pilot, RETURN replaces actions that need one (measured)."""
LINK_ACTIONS = {1: HOLD, 2: RETURN, 3: LAND, 5: TERMINATE, 6: DISARM}
"""NAV_DLL_ACT and NAV_RCL_ACT -> action."""


class Cause(Enum):
    """Cause of a failsafe: its severity, and its number in PX4's events (0 = none).

    A new cause does not replace an active one of higher severity.
    """

    OFFBOARD_LOST = (1, 0)
    PILOT_LOST = (2, 1)
    GCS_LOST = (3, 2)
    BATTERY = (4, 4)
    POSITION_LOST = (5, 0)

    @property
    def severity(self) -> int:
        """Severity of the cause; higher is worse."""
        return self.value[0]

    @property
    def number(self) -> int:
        """Number of the cause in PX4's events; 0 = none."""
        return self.value[1]


_DELAYED_CAUSES = frozenset({Cause.PILOT_LOST, Cause.GCS_LOST})
"""Causes whose failsafe may wait in Hold for COM_FAIL_ACT_T before it acts."""


@dataclass(eq=False)
class FailsafeActions:
    """Executes the action of the failsafe with the most severe cause."""

    _state: State
    """The autopilot's state; ``failsafe`` is written here."""
    _parameters: ParameterTable
    """COM_FAIL_ACT_T, and the parameters that name actions."""
    _announce: Announcer
    enter: Callable[[Mode], None]
    """Enters a mode and leaves the intended mode as it is."""
    _stop: Callable[[EventKind], None]
    """Stops the motors and announces the event."""
    _announced_action: tuple[Cause, Action] | None = field(default=None, init=False)
    cause: Cause | None = field(default=None, init=False)
    """Cause of the active failsafe, None if none is active."""

    def clear(self) -> None:
        """End the active failsafe."""
        self.cause = self._announced_action = None
        self._state.failsafe = False

    @property
    def holds_before_acting(self) -> bool:
        """Whether a failsafe waits in Hold for COM_FAIL_ACT_T; moved sticks do not end the wait."""
        return (
            self._announced_action is not None
            and self._announced_action[1] is HOLD
            and self.cause in _DELAYED_CAUSES
        )

    def act(self, cause: Cause, action: Action, next_action: Action | None = None) -> None:
        """Execute an action unless a more severe cause is active; announce a new action.

        ``next_action`` is the action after COM_FAIL_ACT_T, None if ``action`` is the last.
        """
        if self.cause is not None and self.cause.severity > cause.severity:
            return
        state = self._state
        if not state.position_valid and action.mode in POSITION_MODES:
            action = LAND
        if self._announced_action != (cause, action):
            self._announce_action(cause, action, next_action)
        self.cause, self._announced_action = cause, (cause, action)
        state.failsafe = True
        mode = action.mode
        if mode is None:
            self._stop(EventKind.DISARMED_BY_FAILSAFE)
            return
        if state.landed:
            mode = Mode.LOITER  # it stays on the ground, and disarms
        if state.mode is not mode:
            self.enter(mode)

    def _announce_action(self, cause: Cause, action: Action, next_action: Action | None) -> None:
        intended_mode = custom_mode(self._state.intended_mode)
        if next_action is not None:
            delay = round(self._parameters["COM_FAIL_ACT_T"])
            arguments = _ENTER_HOLD_LAYOUT.pack(
                intended_mode, next_action.number, delay, cause.number
            )
            self._announce(EventKind.FAILSAFE_HOLD, str(delay), arguments)
        else:
            kind = EventKind.FAILSAFE if cause.number else EventKind.FAILSAFE_UNNAMED
            arguments = _ENTER_LAYOUT.pack(intended_mode, action.number, cause.number)
            self._announce(kind, "", arguments)

    def act_on_link_loss(self, cause: Cause, parameter: str, lost_at_us: int) -> None:
        """Execute the action that a parameter selects; before RTL or LAND, hold for COM_FAIL_ACT_T.

        ``lost_at_us`` is the vehicle time of the loss.
        """
        action = LINK_ACTIONS.get(int(self._parameters[parameter]))
        if action is None:
            return
        delay_over = self._state.time_us - lost_at_us >= self._parameters["COM_FAIL_ACT_T"] * 1e6
        if delay_over or action in (HOLD, DISARM, TERMINATE):
            self.act(cause, action)
        else:
            self.act(cause, HOLD, next_action=action)
