"""What each of ArduCopter's flight modes asks of the rate loop, period by period."""

from collections.abc import Callable
from math import cos, isnan, radians

from sitl_mock.ardupilot.guided import Guided, Task
from sitl_mock.ardupilot.hold import PositionHold, approach
from sitl_mock.ardupilot.return_home import Leg, Return
from sitl_mock.ardupilot.thrust import asked_climb, asked_thrust, boosted, specific_thrust
from sitl_mock.autopilot.attitude_control import AttitudeGains, attitude_rates, body_z
from sitl_mock.autopilot.parameters import ParameterTable
from sitl_mock.autopilot.position_control import PositionDemand, PositionOutput
from sitl_mock.autopilot.setpoints import AttitudeSetpoint
from sitl_mock.autopilot.state import Mode, State
from sitl_mock.physics.quaternion import Quaternion, Vector, along_heading, from_yaw
from sitl_mock.physics.vehicle import ActuatorCommand

THRUST_IS_THRUST = 8
"""Bit of GUID_OPTIONS: a setpoint's thrust is thrust, not a climb rate."""
SPOOL_UP_US = 2_000_000
"""From NAV_TAKEOFF to the rotors' being ready to lift (recorded: it lifts off after 2.3 s)."""
ARRIVAL_ACCELERATION = 0.55
"""A take-off slows down by this, m/s^2 (recorded)."""
ARRIVED_M = 0.1
_SLOWEST_ARRIVAL = 0.1
TOUCHDOWN_THRUST_RATE = 0.43
"""After contact in LAND the thrust falls by this per second (landed 1.6 s after, recorded)."""
LEARNING_S = 10.0
"""MOT_THST_HOVER follows the thrust of a quiet hover with this time constant."""

# The rate loop shapes rates; ArduPilot shapes the attitude that its own modes ask. Yaw's answer is
# slow to begin, so that more than this would swing.
_GAINS = AttitudeGains(4.5, 4.5, 1.5, 1.0, (radians(180.0), radians(180.0), radians(45.0)))
_STILL = ActuatorCommand(False, 0.0, 0.0, 0.0, 0.0)


class ArduPilotModeControl:
    """ArduCopter's `ModeControl`.

    Args:
        state: the autopilot's state; the echoes of the targets are written here.
        parameters: gains, limits and speeds; MOT_THST_HOVER is learned.
        guided: what GUIDED does.
        throttle: specific thrust, m/s^2 -> collective throttle of the rotors.
    """

    def __init__(
        self,
        state: State,
        parameters: ParameterTable,
        guided: Guided,
        throttle: Callable[[float], float],
    ) -> None:
        self._state = state
        self._parameters = parameters
        self._guided = guided
        self._throttle = throttle
        self._hold = PositionHold(state, parameters)
        self._return = Return(state, parameters)
        self._spooling_since_us = 0
        self._silent = False
        self._thrust = 0.0

    def enter(self, mode: Mode) -> None:
        """Begin a mode at the present estimate."""
        self._hold.begin()
        if mode is Mode.RTL:
            self._return.begin()
        if mode is Mode.GUIDED:
            self._guided.hold()

    def shift(self, yaw_step: float, position_step: Vector) -> None:
        """Move what is held along with an estimator reset (rad, m NED), so the vehicle stays."""
        self._hold.shift(yaw_step, position_step)
        self._return.height -= position_step[2]

    @property
    def landing(self) -> bool:
        """Whether the vehicle descends to land."""
        mode = self._state.mode
        return mode is Mode.LAND or (mode is Mode.RTL and self._return.leg is Leg.LAND)

    @property
    def taking_off(self) -> bool:
        """Whether GUIDED takes off."""
        return self._state.mode is Mode.GUIDED and self._guided.task is Task.TAKE_OFF

    def hover_throttle(self) -> float:
        """Return the rotors' throttle at MOT_THST_HOVER."""
        return self._throttle(specific_thrust(float(self._parameters["MOT_THST_HOVER"])))

    def command(self, dt: float) -> ActuatorCommand:
        """Return the command for the next ``dt`` s."""
        state = self._state
        state.position_target.active = False
        # Disarmed, too, the modes that hold a position say that they would (recorded in GUIDED).
        state.height_controlled = state.position_controlled = state.mode not in (
            Mode.STABILIZE,
            Mode.ALT_HOLD,
        )
        if not state.armed:
            self._hold.begin()
            command = _STILL
        elif state.landed and not self.taking_off:
            self._hold.begin()
            self._thrust = 0.0
            command = self._rates((0.0, 0.0, 0.0), 0.0)
        else:
            command = self._fly(dt)
        state.attitude_target.rates = command[1:4]
        state.command = command
        return command

    def _fly(self, dt: float) -> ActuatorCommand:
        mode = self._state.mode
        if mode is Mode.GUIDED:
            return self._fly_guided(dt)
        if mode is Mode.STABILIZE:
            # Somebody holds the sticks in the middle; upright at a hover.
            hover = float(self._parameters["MOT_THST_HOVER"])
            return self._attitude(from_yaw(self._hold.yaw), boosted(hover, self._cos_tilt()))
        if self.landing:
            return self._land(dt)
        if mode is Mode.RTL:
            return self._return_home(dt)
        self._state.height_controlled = True
        return self._held(self._hold.step(0.0, dt, level=mode is Mode.ALT_HOLD), dt)

    def _fly_guided(self, dt: float) -> ActuatorCommand:
        guided = self._guided
        began, guided.changed = guided.changed, False
        if began:
            self._hold.begin()
            self._spooling_since_us = self._state.time_us
        if guided.task is Task.TAKE_OFF:
            return self._take_off(dt)
        if guided.task is Task.ANGLE and guided.angle is not None:
            return self._follow_angle(guided.angle, dt, began=began)
        if guided.task is Task.POSITION:
            return self._follow_position(dt)
        return self._held(self._hold.step(0.0, dt), dt)

    def _take_off(self, dt: float) -> ActuatorCommand:
        state, guided = self._state, self._guided
        if state.landed and state.time_us - self._spooling_since_us < SPOOL_UP_US:
            self._hold.begin()
            return self._rates((0.0, 0.0, 0.0), 0.0)
        left = guided.takeoff_height - state.home_ned[2] - self._hold.climb.height
        fastest = 0.01 * self._parameters["WPNAV_SPEED_UP"]
        speed = max(_SLOWEST_ARRIVAL, approach(left, ARRIVAL_ACCELERATION, fastest))
        if left < ARRIVED_M:
            guided.arrive()
        return self._held(self._hold.step(speed, dt), dt)

    def _follow_angle(self, asked: AttitudeSetpoint, dt: float, *, began: bool) -> ActuatorCommand:
        """Fly rates or an attitude; once they are silent, level and without climbing."""
        state, parameters = self._state, self._parameters
        state.position_controlled = False
        was_silent = self._silent and not began
        self._silent = self._guided.silent(state.time_us, parameters["GUID_TIMEOUT"])
        as_thrust = bool(int(parameters["GUID_OPTIONS"]) & THRUST_IS_THRUST)
        climbs = self._silent or not as_thrust
        state.height_controlled = climbs
        if self._silent and not was_silent:
            self._hold.begin()
        if climbs:
            up = 0.01 * parameters["WPNAV_SPEED_UP"]
            down = 0.01 * parameters["WPNAV_SPEED_DN"]
            climb = 0.0 if self._silent else asked_climb(asked.thrust, up, down)
            thrust = self._hold.step(climb, dt, level=True).thrust
            state.position_target.active = False
        else:
            thrust = asked_thrust(asked.thrust)
        self._thrust = state.attitude_target.thrust = thrust
        # What a climb needs is boosted in any case; what was asked as thrust, if it is so set.
        if climbs or parameters["ATC_ANGLE_BOOST"]:
            thrust = boosted(thrust, self._cos_tilt())
        if self._silent:
            return self._attitude(from_yaw(self._hold.yaw), thrust)
        rates = asked.rates or (0.0, 0.0, 0.0)
        if asked.q is None:
            state.attitude_target.q = state.estimate.q
            return self._rates(rates, thrust)
        p, q, r = attitude_rates(state.estimate.q, asked.q, 0.0, _GAINS)
        state.attitude_target.q = asked.q
        return self._rates((p + rates[0], q + rates[1], r + rates[2]), thrust)

    def _follow_position(self, dt: float) -> ActuatorCommand:
        guided, parameters = self._guided, self._parameters
        asked = guided.position
        moves = asked is not None and isnan(asked.position[0])
        if asked is None or (
            moves and guided.silent(self._state.time_us, parameters["GUID_TIMEOUT"])
        ):
            guided.hold()
            return self._held(self._hold.step(0.0, dt), dt)
        hold = self._hold
        if not isnan(asked.yaw):
            hold.yaw = asked.yaw
        elif not isnan(asked.yaw_rate):
            hold.yaw += asked.yaw_rate * dt
        velocity, acceleration = asked.velocity, asked.acceleration
        if asked.in_body_heading:
            q = self._state.estimate.q
            velocity, acceleration = along_heading(q, velocity), along_heading(q, acceleration)
        demand = PositionDemand(
            asked.position,
            velocity,
            acceleration,
            hold.yaw,
            0.01 * parameters["WPNAV_SPEED"],
            0.01 * parameters["WPNAV_SPEED_UP"],
            0.01 * parameters["WPNAV_SPEED_DN"],
        )
        return self._held(hold.follow(demand, dt), dt)

    def _return_home(self, dt: float) -> ActuatorCommand:
        parameters, way = self._parameters, self._return
        way.step()
        if way.leg is not Leg.CLIMB:
            home = self._state.home_ned
            self._hold.point = (home[0], home[1])
        left = way.height - self._hold.climb.height
        acceleration = 0.01 * parameters["WPNAV_ACCEL_Z"]
        fastest = 0.01 * parameters["WPNAV_SPEED_UP"]
        return self._held(self._hold.step(approach(left, acceleration, fastest), dt), dt)

    def _land(self, dt: float) -> ActuatorCommand:
        """Descend: fast to LAND_ALT_LOW, then at LAND_SPEED; the thrust falls on the ground."""
        state, parameters = self._state, self._parameters
        if state.contact:
            self._thrust = max(0.0, self._thrust - TOUCHDOWN_THRUST_RATE * dt)
            return self._attitude(from_yaw(self._hold.yaw), self._thrust)
        slow = 0.01 * parameters["LAND_SPEED"]
        above = state.home_ned[2] - state.estimate.position_ned[2]
        left = above - 0.01 * parameters["LAND_ALT_LOW"]
        acceleration = 0.01 * parameters["WPNAV_ACCEL_Z"]
        sink = max(slow, approach(left, acceleration, 0.01 * parameters["WPNAV_SPEED_DN"]))
        level = not state.position_valid
        state.position_controlled = not level
        return self._held(self._hold.step(-sink, dt, level=level), dt)

    def _held(self, output: PositionOutput, dt: float) -> ActuatorCommand:
        self._thrust = output.thrust
        self._learn_hover(output, dt)
        return self._attitude(output.q, output.thrust)

    def _learn_hover(self, output: PositionOutput, dt: float) -> None:
        """Follow the thrust of a quiet, level hover, as MOT_HOVER_LEARN asks."""
        state, parameters = self._state, self._parameters
        quiet = self._hold.climb.rate == 0.0 and abs(state.estimate.velocity_ned[2]) < 0.6
        if parameters["MOT_HOVER_LEARN"] and quiet and self._cos_tilt() > cos(radians(5.0)):
            hover = float(parameters["MOT_THST_HOVER"])
            change = dt / LEARNING_S * (output.thrust - hover)
            parameters.set("MOT_THST_HOVER", hover + change)

    def _cos_tilt(self) -> float:
        return body_z(self._state.estimate.q)[2]

    def _attitude(self, target: Quaternion, thrust: float) -> ActuatorCommand:
        self._state.attitude_target.q = target
        self._state.attitude_target.thrust = self._thrust
        return self._rates(attitude_rates(self._state.estimate.q, target, 0.0, _GAINS), thrust)

    def _rates(self, rates: Vector, thrust: float) -> ActuatorCommand:
        """Return the command for rates (rad/s) and ArduPilot's normalised thrust; 0 idles."""
        flying = not self._state.landed or self.taking_off
        throttle = self._throttle(specific_thrust(thrust)) if flying else 0.0
        return ActuatorCommand(True, *rates, throttle)
