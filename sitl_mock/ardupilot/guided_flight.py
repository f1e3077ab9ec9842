"""The control in GUIDED: take-off, attitude or position setpoints, hold."""

from dataclasses import dataclass, field
from math import isnan

from sitl_mock.ardupilot.actuator_output import ActuatorOutput
from sitl_mock.ardupilot.guided import Guided, Task
from sitl_mock.ardupilot.hold import PositionHold, approach_speed
from sitl_mock.ardupilot.thrust import (
    angle_boosted_thrust,
    climb_rate_of_setpoint,
    thrust_of_setpoint,
)
from sitl_mock.autopilot.parameters import ParameterTable
from sitl_mock.autopilot.position_control import setpoint_demand
from sitl_mock.autopilot.setpoints import AttitudeSetpoint, PositionSetpoint
from sitl_mock.autopilot.state import State
from sitl_mock.physics.quaternion import from_yaw
from sitl_mock.physics.vehicle import ActuatorCommand

THRUST_AS_THRUST = 8
"""Bit of GUID_OPTIONS: the thrust field of a setpoint is a thrust, not a climb rate."""
SPOOL_UP_US = 2_000_000
"""Spool-up of the rotors after NAV_TAKEOFF, us (recorded: the vehicle lifts off after 2.3 s)."""
ARRIVAL_DECELERATION = 0.55
"""Deceleration at the end of a take-off, m/s^2 (recorded)."""
ARRIVAL_TOLERANCE_M = 0.1
"""Distance below the take-off height at which a take-off ends, m."""
_MIN_CLIMB_RATE = 0.1
"""Smallest climb rate of a take-off, m/s; a rate decreasing to 0 would never reach the height."""


@dataclass(eq=False)
class GuidedFlight:
    """Executes the task of GUIDED."""

    _state: State
    _parameters: ParameterTable
    """The autopilot's parameters, with the speeds and options of GUIDED."""
    _guided: Guided
    _hold: PositionHold
    """Holds a point, a heading and a height."""
    _output: ActuatorOutput
    """Commands the rate loop and the rotors."""
    _spooling_since_us: int = field(default=0, init=False)
    _timed_out: bool = field(default=False, init=False)

    def command(self, dt: float) -> ActuatorCommand:
        """Return the actuator command for the next ``dt`` s."""
        guided = self._guided
        task_began, guided.task_changed = guided.task_changed, False
        if task_began:
            self._hold.begin()
            self._spooling_since_us = self._state.time_us
        match guided.task, guided.setpoint:
            case Task.TAKE_OFF, _:
                return self._take_off(dt)
            case Task.ANGLE, AttitudeSetpoint() as setpoint:
                return self._follow_angle(setpoint, dt, task_began=task_began)
            case Task.POSITION, PositionSetpoint() as setpoint:
                return self._follow_position(setpoint, dt)
        return self._output.position_command(self._hold.step(0.0, dt), dt)

    def _take_off(self, dt: float) -> ActuatorCommand:
        state, guided = self._state, self._guided
        if state.landed and state.time_us - self._spooling_since_us < SPOOL_UP_US:
            self._hold.begin()
            return self._output.rate_command((0.0, 0.0, 0.0), 0.0)
        remaining_height = (
            guided.takeoff_height - state.home_ned[2] - self._hold.climb_profile.height
        )
        max_speed = 0.01 * self._parameters["WPNAV_SPEED_UP"]
        speed = max(
            _MIN_CLIMB_RATE, approach_speed(remaining_height, ARRIVAL_DECELERATION, max_speed)
        )
        if remaining_height < ARRIVAL_TOLERANCE_M:
            guided.end_takeoff()
        return self._output.position_command(self._hold.step(speed, dt), dt)

    def _follow_angle(
        self, setpoint: AttitudeSetpoint, dt: float, *, task_began: bool
    ) -> ActuatorCommand:
        """Follow rates or an attitude; after GUID_TIMEOUT level the vehicle and hold its height."""
        state, parameters = self._state, self._parameters
        state.position_controlled = False
        was_timed_out = self._timed_out and not task_began
        self._timed_out = self._guided.setpoint_timed_out(state.time_us, parameters["GUID_TIMEOUT"])
        is_thrust = bool(int(parameters["GUID_OPTIONS"]) & THRUST_AS_THRUST)
        is_climb_rate = self._timed_out or not is_thrust
        state.height_controlled = is_climb_rate
        if self._timed_out and not was_timed_out:
            self._hold.begin()
        if is_climb_rate:
            max_climb_rate = 0.01 * parameters["WPNAV_SPEED_UP"]
            max_sink_rate = 0.01 * parameters["WPNAV_SPEED_DN"]
            climb_rate = (
                0.0
                if self._timed_out
                else climb_rate_of_setpoint(setpoint.thrust, max_climb_rate, max_sink_rate)
            )
            thrust = self._hold.step(climb_rate, dt, level=True).thrust
            state.position_target.active = False
        else:
            thrust = thrust_of_setpoint(setpoint.thrust)
        self._output.thrust = state.attitude_target.thrust = thrust
        # The angle boost always applies to a climb rate; to a thrust only if it is enabled.
        if is_climb_rate or parameters["ATC_ANGLE_BOOST"]:
            thrust = angle_boosted_thrust(thrust, self._output.cos_tilt)
        if self._timed_out:
            return self._output.attitude_command(from_yaw(self._hold.yaw), thrust)
        rates = setpoint.rates or (0.0, 0.0, 0.0)
        if setpoint.q is None:
            state.attitude_target.q = state.estimate.q
            return self._output.rate_command(rates, thrust)
        p, q, r = self._output.rates_towards(setpoint.q)
        state.attitude_target.q = setpoint.q
        return self._output.rate_command((p + rates[0], q + rates[1], r + rates[2]), thrust)

    def _follow_position(self, setpoint: PositionSetpoint, dt: float) -> ActuatorCommand:
        guided, parameters = self._guided, self._parameters
        timed_out = guided.setpoint_timed_out(self._state.time_us, parameters["GUID_TIMEOUT"])
        if timed_out and isnan(setpoint.position[0]):
            guided.hold()
            return self._output.position_command(self._hold.step(0.0, dt), dt)
        hold = self._hold
        speed_limits = (
            0.01 * parameters["WPNAV_SPEED"],
            0.01 * parameters["WPNAV_SPEED_UP"],
            0.01 * parameters["WPNAV_SPEED_DN"],
        )
        demand = setpoint_demand(setpoint, self._state.estimate.q, hold.yaw, speed_limits, dt)
        hold.yaw = demand.yaw
        return self._output.position_command(hold.follow(demand, dt), dt)
