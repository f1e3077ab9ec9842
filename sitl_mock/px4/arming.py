"""Whether PX4 may be armed, and when it disarms by itself on the ground."""

from dataclasses import dataclass, field

from sitl_mock.autopilot.events import EventKind
from sitl_mock.autopilot.parameters import ParameterTable
from sitl_mock.autopilot.setpoints import OffboardStream
from sitl_mock.autopilot.state import BatteryWarning, Mode, State
from sitl_mock.px4.health import HealthReport
from sitl_mock.px4.modes import PILOTED_MODES

UNARMABLE_MODES = frozenset({Mode.RTL, Mode.LAND})
"""Modes in which PX4 cannot be armed. When PX4 disarms, it does not return to these modes."""
PREFLIGHT_DISARM_MARGIN_US = 1_000_000
"""Delay beyond COM_DISARM_PRFLT after which an armed vehicle that has not taken off disarms, us
(measured: 11 s with COM_DISARM_PRFLT = 10 s)."""


@dataclass(eq=False)
class ArmingChecks:
    """Finds what forbids arming, and reports it."""

    _state: State
    """The autopilot's state; the problem found is written here."""
    _parameters: ParameterTable
    """The autopilot's parameters; NAV_DLL_ACT and COM_OF_LOSS_T are used."""
    _stream: OffboardStream
    _health: HealthReport
    """Sends the failing checks as events."""
    _ready_us: int
    """Vehicle time at which the estimator is ready."""
    crashed: bool = field(default=False, init=False)

    @property
    def offboard_alive(self) -> bool:
        """Whether offboard setpoints arrive, as `OffboardStream.alive` judges."""
        return self._stream.alive(self._state.time_us, self._parameters["COM_OF_LOSS_T"])

    def find_problem(
        self, *, gcs_alive: bool, pilot_present: bool, arming_refusal: str | None
    ) -> str | None:
        """Store in the state and return why arming is refused now; None if it is allowed.

        ``arming_refusal`` is the reason of an active `RefuseArming` fault.
        """
        state = self._state
        problems = (
            (state.time_us < self._ready_us, "no heading reference"),
            (arming_refusal is not None, arming_refusal),
            (self.crashed, "vehicle has crashed"),
            (not state.position_valid, "no valid position estimate"),
            (state.battery_warning >= BatteryWarning.CRITICAL, "battery too low"),
            (self._gcs_required and not gcs_alive, "no connection to the ground station"),
            (state.mode is Mode.OFFBOARD and not self.offboard_alive, "no offboard signal"),
            (state.mode in PILOTED_MODES and not pilot_present, "no manual control input"),
            (state.mode in UNARMABLE_MODES, "mode is not suitable for arming"),
        )
        first_problem = next((problem for applies, problem in problems if applies), None)
        state.prearm_problem = first_problem
        return first_problem

    def report(self, *, gcs_alive: bool, pilot_present: bool) -> None:
        """Send the health report if it changed and is due: see `HealthReport.step`."""
        self._health.step(
            offboard_alive=self.offboard_alive,
            pilot_present=pilot_present,
            gcs_alive=gcs_alive,
            gcs_required=self._gcs_required,
        )

    @property
    def _gcs_required(self) -> bool:
        return self._parameters["NAV_DLL_ACT"] > 0


@dataclass(eq=False)
class AutoDisarm:
    """Decides when an armed vehicle on the ground disarms."""

    _state: State
    _parameters: ParameterTable
    """COM_DISARM_LAND and COM_DISARM_PRFLT, s; 0 or less means never."""
    _landed_since_us: int = field(default=0, init=False)

    def begin(self) -> None:
        """Start counting the time on the ground, because the vehicle was armed."""
        self._landed_since_us = self._state.time_us

    def disarm_reason(self) -> EventKind | None:
        """Return why the vehicle disarms now, None if it does not."""
        state, parameters = self._state, self._parameters
        if not state.landed:
            self._landed_since_us = state.time_us
            return None
        time_on_ground_us = state.time_us - self._landed_since_us
        if state.took_off:
            delay_s = parameters["COM_DISARM_LAND"]
            return EventKind.DISARMED_BY_LANDING if 0 < delay_s * 1e6 <= time_on_ground_us else None
        delay_s = parameters["COM_DISARM_PRFLT"]
        is_overdue = time_on_ground_us >= delay_s * 1e6 + PREFLIGHT_DISARM_MARGIN_US
        return EventKind.DISARMED_ON_GROUND if delay_s > 0 and is_overdue else None
