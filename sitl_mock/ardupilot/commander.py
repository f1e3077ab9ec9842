"""ArduCopter's arming, modes and GUIDED, as measured."""

from math import isfinite, isnan

from sitl_mock.ardupilot.boot import Boot, Notifier
from sitl_mock.ardupilot.failsafe import ArduPilotFailsafe
from sitl_mock.ardupilot.guided import FatalSetpointError, Guided, Task, attitude_setpoint
from sitl_mock.ardupilot.mode_control import ArduPilotModeControl
from sitl_mock.ardupilot.modes import MODE_FOR_PX4_MODE, POSITION_MODES, arming_problem
from sitl_mock.ardupilot.texts import CRITICAL, INFO
from sitl_mock.autopilot.commander import ACCEPTED, FAILED
from sitl_mock.autopilot.events import EventKind
from sitl_mock.autopilot.parameters import ParameterTable
from sitl_mock.autopilot.setpoints import OffboardStream, position_setpoint
from sitl_mock.autopilot.state import Mode, State
from sitl_mock.link.framing import Message
from sitl_mock.physics.vehicle import Vehicle

LANDED_DISARM_DELAY_US = 500_000
"""Delay from the landing until LAND disarms, us (recorded)."""
_OWN_COMPONENT = 1
YAW_ALIGNMENT_HEIGHT_M = 2.8
"""Height above home at which the estimator realigns its heading, once per flight, m (recorded: 2.7
to 2.9)."""


class ArduPilotCommander:
    """The `Commander` of ArduCopter.

    Args:
        vehicle: the simulated vehicle; the failsafe reads its battery.
    """

    def __init__(
        self,
        state: State,
        parameters: ParameterTable,
        vehicle: Vehicle,
        control: ArduPilotModeControl,
        guided: Guided,
        stream: OffboardStream,
        notifier: Notifier,
        boot: Boot,
    ) -> None:
        self.arming_refusal: str | None = None
        self.pilot_simulated = False
        self.failsafe = ArduPilotFailsafe(
            state, parameters, vehicle, notifier.announce, self._act_on_failsafe
        )
        self._state = state
        self._parameters = parameters
        self._control = control
        self._guided = guided
        self._stream = stream
        self._announce = notifier.announce
        self._notifier = notifier
        self._boot = boot
        self._landed_since_us = 0
        self._crashed = False
        self._internal_error = False
        self._yaw_aligned = False

    @property
    def obeys_setpoints(self) -> bool:
        """Whether attitude setpoints control the vehicle in GUIDED."""
        state = self._state
        follows_attitude = state.mode is Mode.GUIDED and self._guided.task is Task.ANGLE
        return follows_attitude and state.armed and not state.landed

    def arm(self, *, force: bool = False) -> int:
        """Arm, and return a MAV_RESULT; ``force`` skips all checks except for boot and crash."""
        state = self._state
        if state.armed:
            return ACCEPTED
        problem = self._update_prearm_problem()
        if problem is not None and not (force and self._boot.initialised and not self._crashed):
            self._announce(EventKind.ARMING_DENIED, problem)
            return FAILED
        state.armed = True
        state.armed_at_us = self._landed_since_us = state.time_us
        state.took_off = self._yaw_aligned = False
        state.home_ned = state.estimate.position_ned
        state.home_set_at_us = state.time_us
        self._announce(EventKind.ARMED, "")
        self._notifier.send_home()
        self._control.enter(state.mode)
        return ACCEPTED

    def announce_problem(self) -> None:
        """Announce what forbids arming now, if anything does."""
        problem = self._update_prearm_problem()
        if problem is not None:
            self._announce(EventKind.PREFLIGHT_FAIL, problem)

    def disarm(self, *, force: bool = False) -> int:
        """Disarm, and return a MAV_RESULT; in the air this needs ``force``."""
        if not self._state.armed:
            return ACCEPTED
        if not self._state.landed and not force:
            return FAILED
        self._stop_motors(EventKind.DISARMED_BY_COMMAND)
        return ACCEPTED

    def request_mode(self, mode: Mode) -> int:
        """Change the mode, and return a MAV_RESULT; during the boot the mode does not change."""
        state = self._state
        if not self._boot.initialised or mode is state.mode:
            return ACCEPTED
        if state.armed and mode in POSITION_MODES and not state.position_valid:
            self._announce(EventKind.MODE_DENIED, mode.name)
            return FAILED
        self._enter_mode(mode)
        return ACCEPTED

    def take_off(self, height: float) -> int:
        """Climb to a height above home, m; return a MAV_RESULT.

        FAILED unless the vehicle is armed, in GUIDED and on the ground, and the height positive.
        """
        state = self._state
        ready = state.armed and state.landed and state.mode is Mode.GUIDED
        if not ready or not isfinite(height) or height <= 0.0:
            return FAILED
        self._guided.take_off(height)
        return ACCEPTED

    def take_over(self, mode: Mode) -> None:
        """Enter a mode as a pilot who takes over would (fault injection)."""
        self.pilot_simulated = True
        self.request_mode(MODE_FOR_PX4_MODE.get(mode, mode))

    def receive_heartbeat(self, heartbeat: Message) -> None:
        """Record a heartbeat, for the ground station failsafe."""
        self.failsafe.receive_heartbeat(heartbeat)

    def receive_setpoint(self, message: Message) -> None:
        """Accept a setpoint in GUIDED, unless the sender has the autopilot's own MAVLink ids."""
        state = self._state
        own_ids = (self._parameters["MAV_SYSID"], _OWN_COMPONENT)
        if state.mode is not Mode.GUIDED:
            return
        if (message.get_srcSystem(), message.get_srcComponent()) == own_ids:
            return
        if message.get_type() == "SET_ATTITUDE_TARGET":
            self._receive_attitude_setpoint(message)
            return
        setpoint = position_setpoint(message)
        if setpoint is not None:
            self._stream.accept(setpoint, state.time_us)
            self._guided.follow(setpoint, state.time_us)

    def _receive_attitude_setpoint(self, message: Message) -> None:
        state = self._state
        try:
            setpoint = attitude_setpoint(message)
        except FatalSetpointError:
            state.aborted = True
            return
        if setpoint is None:
            self._guided.hold()
            return
        if setpoint.rates is not None and any(map(isnan, setpoint.rates)):
            self._announce_internal_error()
        self._stream.accept(setpoint, state.time_us)
        self._guided.follow(setpoint, state.time_us)

    def _announce_internal_error(self) -> None:
        if not self._internal_error:
            self._announce.say("Internal Errors 0x400", CRITICAL)
        self._internal_error = True

    def step(self, *, crashed: bool) -> None:
        """Update arming, mode and failsafes; called at 20 Hz of vehicle time."""
        state = self._state
        self._crashed = crashed
        self._boot.step()
        if state.armed and crashed:
            self._stop_motors(EventKind.DISARMED_AFTER_CRASH)
        self.failsafe.step()
        self._update_prearm_problem()
        if state.armed:
            self._align_yaw()
            self._disarm_on_ground()

    def _align_yaw(self) -> None:
        """Announce the heading alignment in the air, above `YAW_ALIGNMENT_HEIGHT_M`."""
        state = self._state
        height = state.home_ned[2] - state.estimate.position_ned[2]
        if self._yaw_aligned or height < YAW_ALIGNMENT_HEIGHT_M:
            return
        self._yaw_aligned = True
        for imu in (0, 1):
            self._announce.say(f"EKF3 IMU{imu} MAG0 in-flight yaw alignment complete", INFO)

    def _update_prearm_problem(self) -> str | None:
        """Store in the state and return why arming is refused now; None if it is allowed."""
        state = self._state
        state.prearm_problem = arming_problem(
            state,
            initialised=self._boot.initialised,
            home_set=self._boot.home_set,
            crashed=self._crashed,
            gcs_failsafe=self.failsafe.gcs_lost,
            arming_refusal=self.arming_refusal,
        )
        return state.prearm_problem

    def _disarm_on_ground(self) -> None:
        state = self._state
        if not state.landed or self._control.taking_off:
            self._landed_since_us = state.time_us
            return
        time_on_ground_us = state.time_us - self._landed_since_us
        delay_us = self._parameters["DISARM_DELAY"] * 1e6
        if self._control.landing and state.took_off:
            if time_on_ground_us >= LANDED_DISARM_DELAY_US:
                self._stop_motors(EventKind.DISARMED_BY_LANDING)
        elif 0.0 < delay_us <= time_on_ground_us:
            self._stop_motors(EventKind.DISARMED_ON_GROUND)

    def _stop_motors(self, kind: EventKind) -> None:
        self._state.armed = False
        self._announce(kind, "")
        self._notifier.send_parameter("MOT_THST_HOVER")  # the learned value is saved
        if self._state.mode is Mode.GUIDED:
            self._guided.hold()

    def _act_on_failsafe(self, mode: Mode) -> None:
        """Enter the mode of a failsafe, or LAND if that mode needs a position and there is none.

        On the ground, disarm instead.
        """
        state = self._state
        if state.landed:
            self._stop_motors(EventKind.DISARMED_ON_GROUND)
        elif mode in POSITION_MODES and not state.position_valid:
            self._enter_mode(Mode.LAND)
        elif state.mode is not mode:
            self._enter_mode(mode)

    def _enter_mode(self, mode: Mode) -> None:
        self._state.mode = self._state.intended_mode = mode
        self._control.enter(mode)
