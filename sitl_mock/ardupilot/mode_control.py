"""The actuator command of each period in each of ArduCopter's modes."""

from collections.abc import Callable

from sitl_mock.ardupilot.actuator_output import ActuatorOutput
from sitl_mock.ardupilot.guided import Guided
from sitl_mock.ardupilot.guided_flight import GuidedFlight
from sitl_mock.ardupilot.hold import PositionHold, approach_speed
from sitl_mock.ardupilot.return_home import Leg, ReturnHome
from sitl_mock.ardupilot.thrust import angle_boosted_thrust, specific_thrust
from sitl_mock.autopilot.parameters import ParameterTable
from sitl_mock.autopilot.state import Mode, State
from sitl_mock.physics.quaternion import Vector, from_yaw
from sitl_mock.physics.vehicle import DISARMED_COMMAND, ActuatorCommand

TOUCHDOWN_THRUST_RATE = 0.43
"""Decrease of the normalised thrust after contact in LAND, 1/s (recorded: landed after 1.6 s)."""


class ArduPilotModeControl:
    """The `ModeControl` of ArduCopter.

    Args:
        state: the autopilot's state; its command and targets are written here.
        parameters: gains, limits and speeds; MOT_THST_HOVER is written here.
        to_throttle: specific thrust, m/s^2 -> collective throttle of the rotors.
    """

    def __init__(
        self,
        state: State,
        parameters: ParameterTable,
        guided: Guided,
        to_throttle: Callable[[float], float],
    ) -> None:
        self._state = state
        self._parameters = parameters
        self._guided = guided
        self._to_throttle = to_throttle
        self._hold = PositionHold(state, parameters)
        self._output = ActuatorOutput(state, parameters, guided, self._hold, to_throttle)
        self._guided_flight = GuidedFlight(state, parameters, guided, self._hold, self._output)
        self._return = ReturnHome(state, parameters)

    def enter(self, mode: Mode) -> None:
        """Begin a mode from the estimated position, velocity and heading."""
        self._hold.begin()
        if mode is Mode.RTL:
            self._return.begin()
        if mode is Mode.GUIDED:
            self._guided.hold()

    def shift(self, yaw_step: float, position_step: Vector) -> None:
        """Move the held heading (rad) and position (m, NED) by the jumps of an estimator reset."""
        self._hold.shift(yaw_step, position_step)
        self._return.height -= position_step[2]

    @property
    def landing(self) -> bool:
        """Whether the vehicle descends to land."""
        mode = self._state.mode
        return mode is Mode.LAND or (mode is Mode.RTL and self._return.leg is Leg.LAND)

    @property
    def taking_off(self) -> bool:
        """Whether a take-off in GUIDED is under way."""
        return self._output.taking_off

    def hover_throttle(self) -> float:
        """Return the rotors' throttle at MOT_THST_HOVER."""
        return self._to_throttle(specific_thrust(float(self._parameters["MOT_THST_HOVER"])))

    def command(self, dt: float) -> ActuatorCommand:
        """Return the actuator command for the next ``dt`` s."""
        state = self._state
        state.position_target.active = False
        # Modes that hold a position report it even when disarmed (recorded in GUIDED).
        state.height_controlled = state.position_controlled = state.mode not in (
            Mode.STABILIZE,
            Mode.ALT_HOLD,
        )
        if not state.armed:
            self._hold.begin()
            command = DISARMED_COMMAND
        elif state.landed and not self.taking_off:
            self._hold.begin()
            self._output.thrust = 0.0
            command = self._output.rate_command((0.0, 0.0, 0.0), 0.0)
        else:
            command = self._fly(dt)
        state.attitude_target.rates = command[1:4]
        state.command = command
        return command

    def _fly(self, dt: float) -> ActuatorCommand:
        mode = self._state.mode
        if mode is Mode.GUIDED:
            return self._guided_flight.command(dt)
        if mode is Mode.STABILIZE:
            # A pilot with centred sticks: level at the hover thrust.
            hover_thrust = float(self._parameters["MOT_THST_HOVER"])
            return self._output.attitude_command(
                from_yaw(self._hold.yaw), angle_boosted_thrust(hover_thrust, self._output.cos_tilt)
            )
        if self.landing:
            return self._land(dt)
        if mode is Mode.RTL:
            return self._return_home(dt)
        self._state.height_controlled = True
        return self._output.position_command(
            self._hold.step(0.0, dt, level=mode is Mode.ALT_HOLD), dt
        )

    def _return_home(self, dt: float) -> ActuatorCommand:
        parameters, return_home = self._parameters, self._return
        return_home.step()
        if return_home.leg is not Leg.CLIMB:
            home = self._state.home_ned
            self._hold.position_ne = (home[0], home[1])
        remaining_height = return_home.height - self._hold.climb_profile.height
        acceleration = 0.01 * parameters["WPNAV_ACCEL_Z"]
        max_speed = 0.01 * parameters["WPNAV_SPEED_UP"]
        return self._output.position_command(
            self._hold.step(approach_speed(remaining_height, acceleration, max_speed), dt), dt
        )

    def _land(self, dt: float) -> ActuatorCommand:
        """Descend fast to LAND_ALT_LOW, then at LAND_SPEED; reduce the thrust on the ground."""
        state, parameters = self._state, self._parameters
        if state.ground_contact:
            self._output.thrust = max(0.0, self._output.thrust - TOUCHDOWN_THRUST_RATE * dt)
            return self._output.attitude_command(from_yaw(self._hold.yaw), self._output.thrust)
        land_speed = 0.01 * parameters["LAND_SPEED"]
        height = state.home_ned[2] - state.estimate.position_ned[2]
        remaining_height = height - 0.01 * parameters["LAND_ALT_LOW"]
        acceleration = 0.01 * parameters["WPNAV_ACCEL_Z"]
        sink_rate = max(
            land_speed,
            approach_speed(remaining_height, acceleration, 0.01 * parameters["WPNAV_SPEED_DN"]),
        )
        level = not state.position_valid
        state.position_controlled = not level
        return self._output.position_command(self._hold.step(-sink_rate, dt, level=level), dt)
