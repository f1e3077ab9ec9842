"""PX4's flight tasks: the setpoints of the position controller in each mode."""

from math import hypot, nan, radians, tan

from sitl_mock.autopilot.parameters import ParameterTable
from sitl_mock.autopilot.position_control import PositionDemand, setpoint_demand
from sitl_mock.autopilot.setpoints import PositionSetpoint
from sitl_mock.autopilot.state import NAN_VECTOR, Mode, State
from sitl_mock.physics.quaternion import Vector, yaw
from sitl_mock.physics.rigid_body import GRAVITY

CRAWL_HEIGHT_M = 0.65
"""Height below which LAND descends at MPC_LAND_CRWL (recorded with a distance sensor)."""
BRAKING_S = 0.7
"""Ratio of stopping distance to speed when a mode with a held point begins, s."""
LEVEL_DEMAND_ACCELERATION: Vector = (0.0, 0.0, nan)
"""Acceleration demand that keeps the vehicle level but holds no horizontal position, m/s^2 NED."""


class FlightTasks:
    """Computes the demand on the position controller, from the mode or from a setpoint."""

    def __init__(self, state: State, parameters: ParameterTable) -> None:
        self._state = state
        self._parameters = parameters
        self._hold_position: Vector = (0.0, 0.0, 0.0)
        self.yaw = 0.0
        """Heading to hold, rad."""
        self._takeoff_z = 0.0
        self._entered_us = 0
        self._descending = False

    def enter(
        self, mode: Mode, *, takeoff_z: float | None = None, hold_position: Vector | None = None
    ) -> None:
        """Begin a mode from the estimated position, velocity and heading.

        `takeoff_z`: down position at which TAKEOFF ends, m; None = unchanged. `hold_position`:
        position to hold in LOITER, m NED; None = where the vehicle can stop.
        """
        estimate = self._state.estimate
        self._entered_us = self._state.time_us
        self.yaw = yaw(estimate.q)
        x, y, z = estimate.position_ned
        vx, vy, vz = estimate.velocity_ned
        self._hold_position = hold_position or (
            x + BRAKING_S * vx,
            y + BRAKING_S * vy,
            z + BRAKING_S * vz,
        )
        if mode in (Mode.TAKEOFF, Mode.LAND):
            self._hold_position = (x, y, z)
        if takeoff_z is not None:
            self._takeoff_z = takeoff_z
        if mode is Mode.RTL:
            self._begin_return()

    def shift(self, yaw_step: float, position_step: Vector) -> None:
        """Move the held heading (rad) and position (m, NED) by the jumps of an estimator reset."""
        x, y, z = self._hold_position
        dx, dy, dz = position_step
        self._hold_position = (x + dx, y + dy, z + dz)
        self._takeoff_z += dz
        self.yaw += yaw_step

    @property
    def takeoff_reached(self) -> bool:
        """Whether TAKEOFF is less than 0.3 m below the height at which it ends."""
        return self._state.estimate.position_ned[2] - self._takeoff_z < 0.3

    @property
    def landing(self) -> bool:
        """Whether the vehicle descends to land."""
        mode = self._state.mode
        return mode is Mode.LAND or (mode is Mode.RTL and self._descending)

    def demand(self) -> PositionDemand:
        """Return what the present mode demands of the position controller."""
        mode = self._state.mode
        if mode is Mode.TAKEOFF:
            return self._takeoff()
        if mode is Mode.LAND:
            return self._land()
        if mode is Mode.RTL:
            return self._return()
        if mode is Mode.ALTCTL:
            level_position = (nan, nan, self._hold_position[2])
            return PositionDemand(level_position, NAN_VECTOR, LEVEL_DEMAND_ACCELERATION, self.yaw)
        parameters = self._parameters
        return PositionDemand(
            self._hold_position,
            NAN_VECTOR,
            yaw=self.yaw,
            max_speed=parameters["MPC_XY_CRUISE"],
            max_up_speed=parameters["MPC_Z_V_AUTO_UP"],
            max_down_speed=parameters["MPC_Z_V_AUTO_DN"],
        )

    def _takeoff(self) -> PositionDemand:
        parameters, state = self._parameters, self._state
        speed = parameters["MPC_TKO_SPEED"]
        x, y, _ = self._hold_position
        if not state.ground_contact:
            target = (x, y, self._takeoff_z)
            return PositionDemand(target, NAN_VECTOR, yaw=self.yaw, max_up_speed=speed)
        # On the ground the climb rate ramps up from the value at which the thrust is zero.
        ramp_begin_us = max(
            self._entered_us, state.armed_at_us + parameters["COM_SPOOLUP_TIME"] * 1e6
        )
        ramp_progress = (state.time_us - ramp_begin_us) / (
            1e6 * max(parameters["MPC_TKO_RAMP_T"], 0.1)
        )
        zero_thrust_rate = -GRAVITY / parameters["MPC_Z_VEL_P_ACC"]
        climb_rate = zero_thrust_rate + (speed - zero_thrust_rate) * max(
            0.0, min(1.0, ramp_progress)
        )
        return PositionDemand(
            NAN_VECTOR,
            (nan, nan, -climb_rate),
            LEVEL_DEMAND_ACCELERATION,
            self.yaw,
            max_down_speed=3.0,
        )

    def _land(self) -> PositionDemand:
        x, y, _ = self._hold_position
        velocity = (nan, nan, self._descent_speed())
        if not self._state.position_valid:
            return PositionDemand(NAN_VECTOR, velocity, LEVEL_DEMAND_ACCELERATION, self.yaw)
        return PositionDemand((x, y, nan), velocity, yaw=self.yaw, max_down_speed=10.0)

    def _descent_speed(self) -> float:
        parameters = self._parameters
        height = self._state.home_ned[2] - self._state.estimate.position_ned[2]
        land_speed, max_speed = parameters["MPC_LAND_SPEED"], parameters["MPC_Z_V_AUTO_DN"]
        slow_height, fast_height = parameters["MPC_LAND_ALT2"], parameters["MPC_LAND_ALT1"]
        if height < CRAWL_HEIGHT_M:
            return min(land_speed, parameters["MPC_LAND_CRWL"])
        fraction = max(0.0, min(1.0, (height - slow_height) / max(fast_height - slow_height, 0.1)))
        return land_speed + (max_speed - land_speed) * fraction

    def _begin_return(self) -> None:
        """Choose the return height: the cone's height at this distance, at most RTL_RETURN_ALT.

        The vehicle never descends to this height: it keeps a higher present height, and within
        NAV_ACC_RAD of home it keeps any height.
        """
        parameters, state = self._parameters, self._state
        home = state.home_ned
        x, y, z = state.estimate.position_ned
        distance = hypot(x - home[0], y - home[1])
        acceptance_radius = parameters["NAV_ACC_RAD"]
        height = home[2] - z
        if distance > acceptance_radius:
            cone_angle = radians(max(1.0, min(89.0, parameters["RTL_CONE_ANG"])))
            return_height = min(
                max(distance / tan(cone_angle), 2.0 * acceptance_radius),
                parameters["RTL_RETURN_ALT"],
            )
            height = max(height, return_height)
        self._hold_position = (x, y, home[2] - height)
        self._descending = distance <= acceptance_radius

    def _return(self) -> PositionDemand:
        parameters, state = self._parameters, self._state
        home = state.home_ned
        x, y, z = state.estimate.position_ned
        if not self._descending:
            if z - self._hold_position[2] < 0.5:
                self._hold_position = (home[0], home[1], self._hold_position[2])
            self._descending = hypot(x - home[0], y - home[1]) < parameters["NAV_ACC_RAD"] / 2.0
        if self._descending:
            self._hold_position = (home[0], home[1], nan)
            return self._land()
        return PositionDemand(
            self._hold_position,
            NAN_VECTOR,
            yaw=self.yaw,
            max_speed=parameters["MPC_XY_CRUISE"],
            max_up_speed=parameters["MPC_Z_V_AUTO_UP"],
        )

    def offboard_demand(self, setpoint: PositionSetpoint, dt: float) -> PositionDemand:
        """Return the demand of an offboard setpoint; its yaw rate turns the held heading."""
        parameters = self._parameters
        speed_limits = (
            parameters["MPC_XY_VEL_MAX"],
            parameters["MPC_Z_VEL_MAX_UP"],
            parameters["MPC_Z_VEL_MAX_DN"],
        )
        demand = setpoint_demand(setpoint, self._state.estimate.q, self.yaw, speed_limits, dt)
        self.yaw = demand.yaw
        return demand
