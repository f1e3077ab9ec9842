"""What PX4 does when a link, the position or the battery is lost."""

from enum import Enum, auto
from typing import Protocol

from pymavlink.dialects.v20 import development as dialect

from sitl_mock.modes import Mode
from sitl_mock.offboard import OffboardStream
from sitl_mock.parameters import ParameterTable
from sitl_mock.personality import Occasion
from sitl_mock.px4_modes import NEEDS_POSITION
from sitl_mock.state import BatteryWarning, State

_OFFBOARD_ACTIONS = {4: Mode.LAND, 5: Mode.LOITER}
"""COM_OBL_RC_ACT -> mode without a pilot; every other value returns."""
_LINK_ACTIONS = {1: Mode.LOITER, 2: Mode.RTL, 3: Mode.LAND}
"""NAV_DLL_ACT and NAV_RCL_ACT -> mode."""
_GCS_MARGIN_US = 2_000_000
"""A lost ground station is noticed this much after COM_DL_LOSS_T (measured 12 s for 10 s)."""
_COMPANION_MARGIN_US = 1_500_000
"""A lost companion is told of this much after COM_OBC_LOSS_T (measured 6.5 s for 5 s)."""
_WARNINGS = {
    BatteryWarning.LOW: Occasion.BATTERY_LOW,
    BatteryWarning.CRITICAL: Occasion.BATTERY_CRITICAL,
    BatteryWarning.EMERGENCY: Occasion.BATTERY_EMERGENCY,
}


class _Announce(Protocol):
    def __call__(self, occasion: Occasion, detail: str, /) -> None: ...


class _Enter(Protocol):
    def __call__(self, mode: Mode) -> None: ...


class Cause(Enum):
    """Why a failsafe is active; a later one never replaces an earlier of a higher value."""

    OFFBOARD_LOST = auto()
    PILOT_LOST = auto()
    GCS_LOST = auto()
    BATTERY = auto()
    POSITION_LOST = auto()


class Failsafe:
    """Watches and acts while armed.

    Args:
        state: the autopilot's state.
        parameters: its parameters.
        stream: the offboard setpoints.
        announce: tells of an occasion.
        enter: enters a mode without touching the intended one.
    """

    def __init__(
        self,
        state: State,
        parameters: ParameterTable,
        stream: OffboardStream,
        announce: _Announce,
        enter: _Enter,
    ) -> None:
        self._state = state
        self._parameters = parameters
        self._stream = stream
        self._announce = announce
        self._enter = enter
        self._cause: Cause | None = None
        self._gcs_us: int | None = None
        self._gcs_lost_us: int | None = None
        self._companion_us: int | None = None
        self._companion_lost = False

    def clear(self) -> None:
        """End any failsafe: a mode was commanded, or the vehicle disarmed."""
        self._cause = None
        self._state.failsafe = False
        if self._gcs_lost_us is not None:
            self._gcs_lost_us = -1  # already acted on; it acts again only after being regained

    def heard(self, heartbeat_type: int) -> None:
        """Note a heartbeat of a MAV_TYPE."""
        now = self._state.time_us
        if heartbeat_type == dialect.MAV_TYPE_GCS:
            self._gcs_us = now
        elif heartbeat_type == dialect.MAV_TYPE_ONBOARD_CONTROLLER:
            self._companion_us = now

    @property
    def gcs_alive(self) -> bool:
        """Whether a ground station is heard."""
        if self._gcs_us is None:
            return False
        limit = self._parameters["COM_DL_LOSS_T"] * 1e6 + _GCS_MARGIN_US
        return self._state.time_us - self._gcs_us <= limit

    def step(self) -> None:
        """Look once at everything that may be lost."""
        self._watch_companion()
        self._watch_battery()
        self._watch_gcs()
        if self._state.armed:
            self._watch_position()
            self._watch_offboard()

    def pilot_lost(self) -> None:
        """Act on sticks that are gone while a mode needs them."""
        action = _LINK_ACTIONS.get(int(self._parameters["NAV_RCL_ACT"]))
        if action is not None:
            self._act(Cause.PILOT_LOST, action, Occasion.PILOT_LOST)

    def _act(self, cause: Cause, mode: Mode, occasion: Occasion | None = None) -> None:
        """Enter a mode for a cause, unless a graver one acts; tell of it when it is new."""
        if self._cause is not None and self._cause.value > cause.value:
            return
        if occasion is not None and self._cause is not cause:
            self._announce(occasion, "")
        state = self._state
        if not state.position_valid and mode in NEEDS_POSITION:
            mode = Mode.LAND
        self._cause = cause
        state.failsafe = True
        if state.landed:
            mode = Mode.LOITER  # stays where it stands, and disarms
        if state.mode is not mode:
            self._enter(mode)

    def _watch_offboard(self) -> None:
        state = self._state
        if state.intended_mode is not Mode.OFFBOARD:
            return
        alive = self._stream.alive(state.time_us, self._parameters["COM_OF_LOSS_T"])
        if state.mode is Mode.OFFBOARD and not alive:
            action = int(self._parameters["COM_OBL_RC_ACT"])
            mode = _OFFBOARD_ACTIONS.get(action, Mode.RTL)
            self._act(Cause.OFFBOARD_LOST, mode, Occasion.OFFBOARD_LOST)
        elif alive and self._cause is Cause.OFFBOARD_LOST:
            self.clear()
            self._announce(Occasion.OFFBOARD_REGAINED, "")
            self._enter(Mode.OFFBOARD)

    def _watch_gcs(self) -> None:
        state = self._state
        if self._gcs_us is None:
            return
        if self.gcs_alive:
            self._gcs_lost_us = None
            return
        if self._gcs_lost_us is None:
            self._gcs_lost_us = state.time_us
            self._announce(Occasion.GCS_LOST, "")
        action = _LINK_ACTIONS.get(int(self._parameters["NAV_DLL_ACT"]))
        if action is None or not state.armed or self._gcs_lost_us < 0:
            return
        held = state.time_us - self._gcs_lost_us >= self._parameters["COM_FAIL_ACT_T"] * 1e6
        self._act(Cause.GCS_LOST, action if held else Mode.LOITER)

    def _watch_companion(self) -> None:
        if self._companion_us is None:
            return
        limit = self._parameters["COM_OBC_LOSS_T"] * 1e6 + _COMPANION_MARGIN_US
        lost = self._state.time_us - self._companion_us > limit
        if lost != self._companion_lost:
            self._companion_lost = lost
            self._announce(Occasion.COMPANION_LOST if lost else Occasion.COMPANION_REGAINED, "")

    def _watch_position(self) -> None:
        state = self._state
        if not state.position_valid and state.mode in NEEDS_POSITION:
            self._act(Cause.POSITION_LOST, Mode.LAND, Occasion.POSITION_LOST)

    def _watch_battery(self) -> None:
        state, parameters = self._state, self._parameters
        if state.battery_remaining < parameters["BAT_EMERGEN_THR"]:
            warning = BatteryWarning.EMERGENCY
        elif state.battery_remaining < parameters["BAT_CRIT_THR"]:
            warning = BatteryWarning.CRITICAL
        elif state.battery_remaining < parameters["BAT_LOW_THR"]:
            warning = BatteryWarning.LOW
        else:
            warning = BatteryWarning.OK
        worse = warning > state.battery_warning
        state.battery_warning = warning
        if not worse:
            return
        self._announce(_WARNINGS[warning], "")
        action = int(parameters["COM_LOW_BAT_ACT"])
        if not state.armed or action not in (2, 3) or warning < BatteryWarning.CRITICAL:
            return
        lands = action == 2 or warning is BatteryWarning.EMERGENCY
        self._act(Cause.BATTERY, Mode.LAND if lands else Mode.RTL)
