"""What each of PX4's flight modes asks of the rate loop, period by period."""

from math import hypot, isnan, radians, tan

from sitl_mock.autopilot.attitude_control import attitude_rates, is_usable
from sitl_mock.autopilot.modes import Mode
from sitl_mock.autopilot.offboard import OffboardStream
from sitl_mock.autopilot.parameters import ParameterTable
from sitl_mock.autopilot.position_control import (
    GRAVITY,
    PositionController,
    PositionDemand,
)
from sitl_mock.autopilot.setpoints import PositionSetpoint
from sitl_mock.autopilot.state import NAN, NAN_VECTOR, PositionTargetEcho, State
from sitl_mock.physics.quaternion import Quaternion, Vector, along_heading, from_yaw, yaw
from sitl_mock.physics.vehicle import ActuatorCommand
from sitl_mock.px4.gains import attitude_gains, position_gains
from sitl_mock.px4.modes import PILOTED

DEAD_ATTITUDE_US = 140_000
"""A NaN quaternion under attitude control for longer kills PX4's attitude control until restart."""
TOUCHDOWN_THRUST_RATE = 0.4
"""After contact in LAND the thrust falls by this per second."""
CRAWL_HEIGHT_M = 0.65
"""Below this height LAND goes at MPC_LAND_CRWL (recorded with a distance sensor)."""
BRAKING_S = 0.7
"""Entering a hold, the point to hold lies this many seconds of velocity ahead."""
LEVEL_DEMAND_ACCELERATION: Vector = (0.0, 0.0, NAN)
PRESSED_DOWN: Vector = (0.0, 0.0, 100.0)
"""Disarmed, PX4's own modes ask this acceleration, m/s^2 (recorded)."""
_STILL = ActuatorCommand(False, 0.0, 0.0, 0.0, 0.0)


class Px4ModeControl:
    """PX4's `ModeControl`.

    Args:
        state: the autopilot's state; the echoes of the targets are written here.
        parameters: gains, limits and speeds.
        stream: the offboard setpoints.
    """

    def __init__(self, state: State, parameters: ParameterTable, stream: OffboardStream) -> None:
        self._state = state
        self._parameters = parameters
        self._stream = stream
        self._position = PositionController(lambda: position_gains(parameters))
        self._hold: Vector = (0.0, 0.0, 0.0)
        self._yaw = 0.0
        self._takeoff_z = 0.0
        self._entered_us = 0
        self._descending = False
        self._thrust = 0.0
        self._nan_since_us: int | None = None
        self._attitude_dead = False

    def enter(
        self, mode: Mode, *, takeoff_z: float | None = None, hold: Vector | None = None
    ) -> None:
        """Begin a mode at the present estimate.

        Args:
            mode: the mode entered.
            takeoff_z: where TAKEOFF ends, m down.
            hold: where LOITER goes, NED; None = stop here.
        """
        estimate = self._state.estimate
        self._entered_us = self._state.time_us
        self._yaw = yaw(estimate.q)
        x, y, z = estimate.position_ned
        vx, vy, vz = estimate.velocity_ned
        self._hold = hold or (x + BRAKING_S * vx, y + BRAKING_S * vy, z + BRAKING_S * vz)
        if mode in (Mode.TAKEOFF, Mode.LAND):
            self._hold = (x, y, z)
        if takeoff_z is not None:
            self._takeoff_z = takeoff_z
        if mode is Mode.RTL:
            self._begin_return()
        self._position.reset()

    def shift(self, yaw_step: float, position_step: Vector) -> None:
        """Move what is held along with an estimator reset (rad, m NED), so the vehicle stays."""
        x, y, z = self._hold
        dx, dy, dz = position_step
        self._hold = (x + dx, y + dy, z + dz)
        self._takeoff_z += dz
        self._yaw += yaw_step

    @property
    def takeoff_reached(self) -> bool:
        """Whether TAKEOFF is as good as at its height."""
        return self._state.estimate.position_ned[2] - self._takeoff_z < 0.3

    def command(self, dt: float) -> ActuatorCommand:
        """Return the command for the next ``dt`` s."""
        state = self._state
        state.position_target.active = False
        fresh = self._stream.take_fresh()
        if not state.armed:
            if state.mode is not Mode.OFFBOARD and state.mode not in PILOTED:
                yaw_now = yaw(state.estimate.q)
                state.position_target = PositionTargetEcho(
                    True, NAN_VECTOR, NAN_VECTOR, PRESSED_DOWN, yaw_now
                )
            command = _STILL
        elif state.mode is Mode.OFFBOARD:
            command = self._offboard(dt, fresh=fresh)
        elif state.landed and state.mode is not Mode.TAKEOFF:
            self._position.reset()
            command = self._rates((0.0, 0.0, 0.0), 0.0)
        elif state.mode in (Mode.MANUAL, Mode.STABILIZED):
            hover = float(self._parameters["MPC_THR_HOVER"])
            command = self._attitude(from_yaw(self._yaw), 0.0, hover)
        else:
            command = self._follow(self._demand(), dt)
        self._thrust = command.thrust
        state.attitude_target.rates = command[1:4]
        state.attitude_target.thrust = command.thrust
        state.command = command
        return command

    def _demand(self) -> PositionDemand:
        mode = self._state.mode
        if mode is Mode.TAKEOFF:
            return self._takeoff()
        if mode is Mode.LAND:
            return self._land()
        if mode is Mode.RTL:
            return self._return()
        if mode is Mode.ALTCTL:
            level = (NAN, NAN, self._hold[2])
            return PositionDemand(level, NAN_VECTOR, LEVEL_DEMAND_ACCELERATION, self._yaw)
        parameters = self._parameters
        return PositionDemand(
            self._hold,
            NAN_VECTOR,
            yaw=self._yaw,
            speed=parameters["MPC_XY_CRUISE"],
            up_speed=parameters["MPC_Z_V_AUTO_UP"],
            down_speed=parameters["MPC_Z_V_AUTO_DN"],
        )

    def _takeoff(self) -> PositionDemand:
        parameters, state = self._parameters, self._state
        speed = parameters["MPC_TKO_SPEED"]
        x, y, _ = self._hold
        if not state.contact:
            target = (x, y, self._takeoff_z)
            return PositionDemand(target, NAN_VECTOR, yaw=self._yaw, up_speed=speed)
        # On the ground the climb rate asked grows from where it means no thrust at all.
        self._position.reset()
        began = max(self._entered_us, state.armed_at_us + parameters["COM_SPOOLUP_TIME"] * 1e6)
        ramp = (state.time_us - began) / (1e6 * max(parameters["MPC_TKO_RAMP_T"], 0.1))
        lowest = -GRAVITY / parameters["MPC_Z_VEL_P_ACC"]
        climb = lowest + (speed - lowest) * max(0.0, min(1.0, ramp))
        return PositionDemand(
            NAN_VECTOR, (NAN, NAN, -climb), LEVEL_DEMAND_ACCELERATION, self._yaw, down_speed=3.0
        )

    def _land(self) -> PositionDemand:
        x, y, _ = self._hold
        velocity = (NAN, NAN, self._descent_speed())
        if not self._state.position_valid:
            return PositionDemand(NAN_VECTOR, velocity, LEVEL_DEMAND_ACCELERATION, self._yaw)
        return PositionDemand((x, y, NAN), velocity, yaw=self._yaw, down_speed=10.0)

    def _descent_speed(self) -> float:
        parameters = self._parameters
        height = self._state.home_ned[2] - self._state.estimate.position_ned[2]
        slow, fast = parameters["MPC_LAND_SPEED"], parameters["MPC_Z_V_AUTO_DN"]
        low, high = parameters["MPC_LAND_ALT2"], parameters["MPC_LAND_ALT1"]
        if height < CRAWL_HEIGHT_M:
            return min(slow, parameters["MPC_LAND_CRWL"])
        share = max(0.0, min(1.0, (height - low) / max(high - low, 0.1)))
        return slow + (fast - slow) * share

    def _begin_return(self) -> None:
        """Choose the height of the way home: the cone about home, at most RTL_RETURN_ALT."""
        parameters, state = self._parameters, self._state
        home = state.home_ned
        x, y, z = state.estimate.position_ned
        distance = hypot(x - home[0], y - home[1])
        near = parameters["NAV_ACC_RAD"]
        height = home[2] - z
        if distance > near:
            cone = radians(max(1.0, min(89.0, parameters["RTL_CONE_ANG"])))
            wanted = min(max(distance / tan(cone), 2.0 * near), parameters["RTL_RETURN_ALT"])
            height = max(height, wanted)
        self._hold = (x, y, home[2] - height)
        self._descending = distance <= near

    def _return(self) -> PositionDemand:
        parameters, state = self._parameters, self._state
        home = state.home_ned
        x, y, z = state.estimate.position_ned
        if not self._descending:
            if z - self._hold[2] < 0.5:
                self._hold = (home[0], home[1], self._hold[2])
            self._descending = hypot(x - home[0], y - home[1]) < parameters["NAV_ACC_RAD"] / 2.0
        if self._descending:
            self._hold = (home[0], home[1], NAN)
            return self._land()
        return PositionDemand(
            self._hold,
            NAN_VECTOR,
            yaw=self._yaw,
            speed=parameters["MPC_XY_CRUISE"],
            up_speed=parameters["MPC_Z_V_AUTO_UP"],
        )

    def _follow(self, demand: PositionDemand, dt: float) -> ActuatorCommand:
        state = self._state
        landing = state.mode is Mode.LAND or (state.mode is Mode.RTL and self._descending)
        if landing and state.contact:
            thrust = max(0.0, self._thrust - TOUCHDOWN_THRUST_RATE * dt)
            return self._attitude(from_yaw(self._yaw), 0.0, thrust)
        estimate = state.estimate
        position = estimate.position_ned
        output = self._position.step(demand, position, estimate.velocity_ned, dt)
        state.position_target = PositionTargetEcho(
            True, demand.position, output.velocity, output.acceleration, demand.yaw
        )
        return self._attitude(output.q, 0.0, output.thrust)

    def _offboard(self, dt: float, *, fresh: bool) -> ActuatorCommand:
        setpoint = self._stream.setpoint
        if setpoint is None:
            return self._rates((0.0, 0.0, 0.0), 0.0)
        if isinstance(setpoint, PositionSetpoint):
            return self._follow(self._offboard_demand(setpoint, dt), dt)
        if setpoint.q is None:
            return self._rates(setpoint.rates or (0.0, 0.0, 0.0), setpoint.thrust)
        if setpoint.rates is not None and fresh:
            # Attitude and rates both asked: each message's rates hold until the attitude
            # controller's next turn, so the two fight.
            return self._rates(setpoint.rates, setpoint.thrust)
        return self._attitude(setpoint.q, setpoint.yaw_rate, setpoint.thrust)

    def _offboard_demand(self, setpoint: PositionSetpoint, dt: float) -> PositionDemand:
        parameters = self._parameters
        if not isnan(setpoint.yaw):
            self._yaw = setpoint.yaw
        elif not isnan(setpoint.yaw_rate):
            self._yaw += setpoint.yaw_rate * dt
        velocity, acceleration = setpoint.velocity, setpoint.acceleration
        if setpoint.in_body_heading:
            q = self._state.estimate.q
            velocity, acceleration = along_heading(q, velocity), along_heading(q, acceleration)
        return PositionDemand(
            setpoint.position,
            velocity,
            acceleration,
            self._yaw,
            parameters["MPC_XY_VEL_MAX"],
            parameters["MPC_Z_VEL_MAX_UP"],
            parameters["MPC_Z_VEL_MAX_DN"],
        )

    def _rates(self, rates: Vector, thrust: float) -> ActuatorCommand:
        return ActuatorCommand(True, *rates, thrust)

    def _attitude(self, target: Quaternion, yaw_rate: float, thrust: float) -> ActuatorCommand:
        now = self._state.time_us
        if is_usable(target):
            self._nan_since_us = None
        elif self._nan_since_us is None:
            self._nan_since_us = now
        elif now - self._nan_since_us > DEAD_ATTITUDE_US:
            self._attitude_dead = True
        if self._attitude_dead or self._nan_since_us is not None:
            return self._rates(NAN_VECTOR, thrust)
        self._state.attitude_target.q = target
        rates = attitude_rates(
            self._state.estimate.q, target, yaw_rate, attitude_gains(self._parameters)
        )
        return self._rates(rates, thrust)
