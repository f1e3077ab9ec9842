"""PX4's rules of arming and modes, as measured."""

import struct
from dataclasses import dataclass, field

from sitl_mock.autopilot.commander import ACCEPTED, TEMPORARILY_REJECTED
from sitl_mock.autopilot.events import EventKind
from sitl_mock.autopilot.parameters import ParameterTable
from sitl_mock.autopilot.setpoints import OffboardStream
from sitl_mock.autopilot.state import Mode, State
from sitl_mock.link.framing import Message
from sitl_mock.link.link import Link
from sitl_mock.physics.quaternion import Vector
from sitl_mock.px4.arming import UNARMABLE_MODES, ArmingChecks, AutoDisarm
from sitl_mock.px4.event_log import Announcer
from sitl_mock.px4.failsafe import Failsafe
from sitl_mock.px4.failsafe_actions import FailsafeActions
from sitl_mock.px4.mode_control import Px4ModeControl
from sitl_mock.px4.modes import PILOTED_MODES, POSITION_MODES, custom_mode
from sitl_mock.px4.setpoints import decode_setpoint
from sitl_mock.px4.sticks import Sticks

STATUS_PERIOD_US = 500_000
"""Period at which PX4 publishes an unchanged vehicle status, us (measured)."""


@dataclass(eq=False)
class Px4Commander:
    """The `Commander` of PX4."""

    _state: State
    _parameters: ParameterTable
    _control: Px4ModeControl
    """Begins each mode that is entered."""
    _stream: OffboardStream
    _announce: Announcer
    _checks: ArmingChecks
    """Finds what forbids arming, and sends the health report."""
    arming_refusal: str | None = field(default=None, init=False)
    pilot_simulated: bool = field(default=False, init=False)
    _requested_takeoff_z: float | None = field(default=None, init=False)
    _published_status: tuple[bool, Mode, Mode, bool] | None = field(default=None, init=False)

    def __post_init__(self) -> None:
        self._actions = FailsafeActions(
            self._state, self._parameters, self._announce, self._enter_mode, self._stop_motors
        )
        self.failsafe = Failsafe(self._state, self._parameters, self._announce, self._actions)
        self._sticks = Sticks(self._parameters)
        self._auto_disarm = AutoDisarm(self._state, self._parameters)

    def arm(self, *, force: bool = False) -> int:
        """Arm, and return a MAV_RESULT; ``force`` skips all checks except for a crash."""
        state = self._state
        if state.armed:
            return ACCEPTED
        problem = self._update_prearm_problem()
        if problem is not None and (not force or self._checks.crashed):
            self._announce(EventKind.ARMING_DENIED, "")
            self._announce(EventKind.PREFLIGHT_FAIL, problem)
            return TEMPORARILY_REJECTED
        state.armed = True
        state.armed_at_us = state.time_us
        self._auto_disarm.begin()
        state.took_off = False
        state.home_ned = state.estimate.position_ned
        state.home_q = state.estimate.q
        state.home_set_at_us = state.time_us
        self._announce(EventKind.ARMED, "")
        self._enter_mode(state.mode)
        return ACCEPTED

    def disarm(self, *, force: bool = False) -> int:
        """Disarm, and return a MAV_RESULT; in the air this needs ``force``."""
        if not self._state.armed:
            return ACCEPTED
        if not self._state.landed and not force:
            self._announce(EventKind.DISARM_DENIED, "")
            return TEMPORARILY_REJECTED
        self._stop_motors(EventKind.DISARMED_BY_COMMAND)
        return ACCEPTED

    def request_mode(
        self, mode: Mode, *, takeoff_z: float | None = None, hold_position: Vector | None = None
    ) -> int:
        """Change the intended mode, and return a MAV_RESULT.

        A disarmed vehicle enters every mode (arming may fail then). An armed one refuses a mode
        that cannot run.

        `takeoff_z`: down position where TAKEOFF ends, m; None = MIS_TAKEOFF_ALT above home.
        `hold_position`: position to hold in LOITER, m NED; None = where the vehicle can stop.
        """
        state = self._state
        if state.armed and not self._can_run(mode):
            packed_mode = struct.pack("<I", custom_mode(mode))
            self._announce(EventKind.MODE_DENIED, mode.name.capitalize(), packed_mode)
            return TEMPORARILY_REJECTED
        self._set_intended(mode)
        self.failsafe.clear()
        if mode is Mode.TAKEOFF:
            self._requested_takeoff_z = takeoff_z
        self._enter_mode(mode, hold_position=hold_position)
        return ACCEPTED

    def land(self) -> int:
        """Execute NAV_LAND; return a MAV_RESULT. Unlike the mode LAND, NAV_LAND is announced."""
        result = self.request_mode(Mode.LAND)
        if result == ACCEPTED:
            self._announce(EventKind.LANDING_COMMANDED, "")
        return result

    def take_over(self, mode: Mode) -> None:
        """Enter a mode as a pilot who takes over would (fault injection)."""
        self.pilot_simulated = True
        self._announce(EventKind.PILOT_TOOK_OVER, "")
        self.request_mode(mode)

    def receive_heartbeat(self, heartbeat: Message) -> None:
        """Record the heartbeat of a ground station or a companion, told apart by MAV_TYPE."""
        self.failsafe.receive_heartbeat(heartbeat.type)

    def receive_manual_control(self, message: Message, _: Link) -> None:
        """Handle MANUAL_CONTROL, a pilot's sticks."""
        self._sticks.receive(message, self._state.time_us)

    def receive_setpoint(self, message: Message) -> None:
        """Accept a setpoint in any mode, if MAV_FWDEXTSP is set and PX4 would not ignore it."""
        setpoint = decode_setpoint(message)
        if setpoint is not None and self._parameters["MAV_FWDEXTSP"]:
            self._stream.accept(setpoint, self._state.time_us)

    @property
    def obeys_setpoints(self) -> bool:
        """Whether the vehicle is armed in OFFBOARD."""
        return self._state.armed and self._state.mode is Mode.OFFBOARD

    def announce_problem(self) -> None:
        """Announce what forbids arming now, if anything does."""
        problem = self._update_prearm_problem()
        if problem is not None:
            self._announce(EventKind.PREFLIGHT_FAIL, problem)

    def step(self, *, crashed: bool) -> None:
        """Update arming, mode and failsafes; called at 20 Hz of vehicle time."""
        state = self._state
        self._checks.crashed = crashed
        if state.armed and crashed:
            self._stop_motors(EventKind.DISARMED_AFTER_CRASH)
        self._update_prearm_problem()
        self._checks.report(gcs_alive=self.failsafe.gcs_alive, pilot_present=self._pilot_present)
        self._detect_stick_override()
        self.failsafe.step(
            offboard_alive=self._checks.offboard_alive, pilot_present=self._pilot_present
        )
        if state.armed:
            if state.mode is Mode.TAKEOFF and state.took_off and self._control.takeoff_reached:
                if state.intended_mode is Mode.TAKEOFF:
                    self._set_intended(Mode.LOITER)
                self._enter_mode(Mode.LOITER)
            kind = self._auto_disarm.disarm_reason()
            if kind is not None:
                self._stop_motors(kind)
        self._publish_status()

    @property
    def _pilot_present(self) -> bool:
        """Whether a pilot holds the sticks, by fault injection or by MANUAL_CONTROL."""
        return self.pilot_simulated or self._sticks.present(self._state.time_us)

    def _update_prearm_problem(self) -> str | None:
        return self._checks.find_problem(
            gcs_alive=self.failsafe.gcs_alive,
            pilot_present=self._pilot_present,
            arming_refusal=self.arming_refusal,
        )

    def _detect_stick_override(self) -> None:
        """Switch to POSCTL if a pilot moves the sticks in the air in an automatic mode."""
        state = self._state
        in_automatic_flight = state.armed and not state.landed and state.mode not in PILOTED_MODES
        if not in_automatic_flight or self._actions.holds_before_acting:
            return
        if self._sticks.are_overriding(state.time_us):
            self._announce(EventKind.PILOT_TOOK_OVER, "")
            self.request_mode(Mode.POSCTL)

    def _stop_motors(self, kind: EventKind) -> None:
        state = self._state
        state.armed = False
        # Measured: a landing from OFFBOARD, by command or by failsafe, ends in OFFBOARD.
        state.intended_mode = state.mode_after_disarming
        self.failsafe.clear()
        self._enter_mode(state.intended_mode)
        self._announce(kind, "")

    def _set_intended(self, mode: Mode) -> None:
        """Set the mode that the user intends.

        Disarming returns to the last intended mode that can be armed, except TAKEOFF (measured).
        """
        self._state.intended_mode = mode
        if mode not in UNARMABLE_MODES and mode is not Mode.TAKEOFF:
            self._state.mode_after_disarming = mode

    def _publish_status(self) -> None:
        """Publish the status when it changed, else twice a second."""
        state = self._state
        status = (state.armed, state.mode, state.intended_mode, state.failsafe)
        if (
            status != self._published_status
            or state.time_us - state.status_published_us >= STATUS_PERIOD_US
        ):
            self._published_status, state.status_published_us = status, state.time_us

    def _can_run(self, mode: Mode) -> bool:
        if mode is Mode.OFFBOARD:
            return self._checks.offboard_alive
        if mode in PILOTED_MODES and not self._pilot_present:
            return False
        return self._state.position_valid or mode not in POSITION_MODES

    def _enter_mode(self, mode: Mode, *, hold_position: Vector | None = None) -> None:
        """Enter a mode without changing the intended mode."""
        self._state.mode = mode
        takeoff_z = self._takeoff_z() if mode is Mode.TAKEOFF else None
        self._control.enter(mode, takeoff_z=takeoff_z, hold_position=hold_position)

    def _takeoff_z(self) -> float:
        """Return the down position at which TAKEOFF ends, m: as requested, or MIS_TAKEOFF_ALT."""
        if self._requested_takeoff_z is not None:
            return self._requested_takeoff_z
        altitude = self._parameters["MIS_TAKEOFF_ALT"]
        if self._state.armed:
            packed_altitude = struct.pack("<f", altitude)
            self._announce(EventKind.DEFAULT_TAKEOFF_ALTITUDE, f"{altitude:.1f}", packed_altitude)
        return self._state.home_ned[2] - altitude
