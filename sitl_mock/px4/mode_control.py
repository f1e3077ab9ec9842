"""The actuator command of each period in each of PX4's modes."""

from math import radians

from sitl_mock.autopilot.attitude_control import AttitudeGains, attitude_rates, is_usable_quaternion
from sitl_mock.autopilot.parameters import ParameterTable
from sitl_mock.autopilot.position_control import PositionController, PositionDemand, PositionGains
from sitl_mock.autopilot.setpoints import OffboardStream, PositionSetpoint
from sitl_mock.autopilot.state import NAN_VECTOR, Mode, PositionTarget, State
from sitl_mock.physics.quaternion import Quaternion, Vector, from_yaw, yaw
from sitl_mock.physics.vehicle import DISARMED_COMMAND, ActuatorCommand
from sitl_mock.px4.flight_tasks import FlightTasks
from sitl_mock.px4.modes import PILOTED_MODES

ATTITUDE_FAILURE_DELAY_US = 140_000
"""Time of unusable quaternions, such as NaN, after which PX4's attitude control fails until a
restart, us."""
TOUCHDOWN_THRUST_RATE = 0.4
"""Decrease of the normalised thrust after contact in LAND, 1/s."""
DISARMED_ACCELERATION: Vector = (0.0, 0.0, 100.0)
"""Acceleration setpoint of PX4's own modes while disarmed, m/s^2 (recorded)."""


class Px4ModeControl:
    """The `ModeControl` of PX4.

    Args:
        state: the autopilot's state; its command and targets are written here.
    """

    def __init__(self, state: State, parameters: ParameterTable, stream: OffboardStream) -> None:
        self._state = state
        self._parameters = parameters
        self._stream = stream
        self._tasks = FlightTasks(state, parameters)
        self._position_controller = PositionController(lambda: position_gains(parameters))
        self._last_thrust = 0.0
        self._attitude_unusable_since_us: int | None = None
        self._attitude_failed = False

    def enter(
        self, mode: Mode, *, takeoff_z: float | None = None, hold_position: Vector | None = None
    ) -> None:
        """Begin a mode from the estimated motion and heading; see `FlightTasks.enter`."""
        self._tasks.enter(mode, takeoff_z=takeoff_z, hold_position=hold_position)
        self._position_controller.reset()

    def shift(self, yaw_step: float, position_step: Vector) -> None:
        """Move the held heading (rad) and position (m, NED) by the jumps of an estimator reset."""
        self._tasks.shift(yaw_step, position_step)

    @property
    def takeoff_reached(self) -> bool:
        """Whether TAKEOFF is less than 0.3 m below the height at which it ends."""
        return self._tasks.takeoff_reached

    def command(self, dt: float) -> ActuatorCommand:
        """Return the actuator command for the next ``dt`` s."""
        state = self._state
        state.position_target.active = False
        fresh = self._stream.take_fresh()
        if not state.armed:
            command = DISARMED_COMMAND
        elif state.mode is Mode.OFFBOARD:
            command = self._follow_offboard(dt, fresh=fresh)
        elif state.landed and state.mode is not Mode.TAKEOFF:
            self._position_controller.reset()
            command = self._rate_command((0.0, 0.0, 0.0), 0.0)
        elif state.mode in (Mode.MANUAL, Mode.STABILIZED):
            hover_thrust = float(self._parameters["MPC_THR_HOVER"])
            command = self._attitude_command(from_yaw(self._tasks.yaw), 0.0, hover_thrust)
        else:
            if state.mode is Mode.TAKEOFF and state.ground_contact:
                self._position_controller.reset()
            command = self._follow(self._tasks.demand(), dt)
        self._last_thrust = command.thrust
        state.attitude_target.rates = command[1:4]
        state.attitude_target.thrust = command.thrust
        state.command = command
        if not state.armed and state.mode is not Mode.OFFBOARD and state.mode not in PILOTED_MODES:
            self._show_disarmed_targets()
        return command

    def _show_disarmed_targets(self) -> None:
        """Set the targets that PX4's controllers compute while disarmed; the motors stand still."""
        state = self._state
        yaw_now = yaw(state.estimate.q)
        state.position_target = PositionTarget(
            True, NAN_VECTOR, NAN_VECTOR, DISARMED_ACCELERATION, yaw_now
        )
        levelling = self._attitude_command(from_yaw(yaw_now), 0.0, 0.0)
        state.attitude_target.rates = levelling[1:4]

    def _follow(self, demand: PositionDemand, dt: float) -> ActuatorCommand:
        state = self._state
        if self._tasks.landing and state.ground_contact:
            thrust = max(0.0, self._last_thrust - TOUCHDOWN_THRUST_RATE * dt)
            return self._attitude_command(from_yaw(self._tasks.yaw), 0.0, thrust)
        estimate = state.estimate
        position = estimate.position_ned
        output = self._position_controller.step(demand, position, estimate.velocity_ned, dt)
        state.position_target = PositionTarget(
            True, demand.position, output.velocity, output.acceleration, demand.yaw
        )
        return self._attitude_command(output.q, 0.0, output.thrust)

    def _follow_offboard(self, dt: float, *, fresh: bool) -> ActuatorCommand:
        setpoint = self._stream.setpoint
        if setpoint is None:
            return self._rate_command((0.0, 0.0, 0.0), 0.0)
        if isinstance(setpoint, PositionSetpoint):
            return self._follow(self._tasks.offboard_demand(setpoint, dt), dt)
        if setpoint.q is None:
            return self._rate_command(setpoint.rates or (0.0, 0.0, 0.0), setpoint.thrust)
        if setpoint.rates is not None and fresh:
            # With attitude and rates, the rates apply until the next step of the attitude
            # controller, so the two compete.
            return self._rate_command(setpoint.rates, setpoint.thrust)
        return self._attitude_command(setpoint.q, setpoint.yaw_rate, setpoint.thrust)

    def _rate_command(self, rates: Vector, thrust: float) -> ActuatorCommand:
        return ActuatorCommand(True, *rates, thrust)

    def _attitude_command(
        self, target: Quaternion, yaw_rate: float, thrust: float
    ) -> ActuatorCommand:
        now = self._state.time_us
        if is_usable_quaternion(target):
            self._attitude_unusable_since_us = None
        elif self._attitude_unusable_since_us is None:
            self._attitude_unusable_since_us = now
        elif now - self._attitude_unusable_since_us > ATTITUDE_FAILURE_DELAY_US:
            self._attitude_failed = True
        if self._attitude_failed or self._attitude_unusable_since_us is not None:
            return self._rate_command(NAN_VECTOR, thrust)
        self._state.attitude_target.q = target
        rates = attitude_rates(
            self._state.estimate.q, target, yaw_rate, attitude_gains(self._parameters)
        )
        return self._rate_command(rates, thrust)


def position_gains(parameters: ParameterTable) -> PositionGains:
    """Return the position controller's gains and limits."""
    return PositionGains(
        parameters["MPC_XY_P"],
        parameters["MPC_Z_P"],
        parameters["MPC_XY_VEL_P_ACC"],
        parameters["MPC_Z_VEL_P_ACC"],
        parameters["MPC_XY_VEL_I_ACC"],
        parameters["MPC_Z_VEL_I_ACC"],
        radians(parameters["MPC_TILTMAX_AIR"]),
        parameters["MPC_THR_HOVER"],
        parameters["MPC_THR_MIN"],
        parameters["MPC_THR_MAX"],
    )


def attitude_gains(parameters: ParameterTable) -> AttitudeGains:
    """Return the attitude controller's gains and limits."""
    return AttitudeGains(
        parameters["MC_ROLL_P"],
        parameters["MC_PITCH_P"],
        parameters["MC_YAW_P"],
        parameters["MC_YAW_WEIGHT"],
        (
            radians(parameters["MC_ROLLRATE_MAX"]),
            radians(parameters["MC_PITCHRATE_MAX"]),
            radians(parameters["MC_YAWRATE_MAX"]),
        ),
    )
