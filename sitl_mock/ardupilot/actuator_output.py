"""Converts attitude or rates, with thrust, to the actuator command."""

from collections.abc import Callable
from dataclasses import dataclass, field
from math import cos, radians

from sitl_mock.ardupilot.guided import Guided, Task
from sitl_mock.ardupilot.hold import PositionHold
from sitl_mock.ardupilot.thrust import specific_thrust
from sitl_mock.autopilot.attitude_control import AttitudeGains, attitude_rates, body_z
from sitl_mock.autopilot.parameters import ParameterTable
from sitl_mock.autopilot.position_control import PositionOutput
from sitl_mock.autopilot.state import Mode, State
from sitl_mock.physics.quaternion import Quaternion, Vector
from sitl_mock.physics.vehicle import ActuatorCommand

HOVER_LEARNING_TIME_S = 10.0
"""Time constant with which MOT_THST_HOVER follows the thrust of a steady hover, s."""
# In ArduPilot's own modes the attitude target is shaped; the mock shapes the rates instead. Its yaw
# response is slow, so a yaw gain as high as ATC_ANG_YAW_P (4.5) would oscillate.
_ATTITUDE_GAINS = AttitudeGains(4.5, 4.5, 1.5, 1.0, (radians(180.0), radians(180.0), radians(45.0)))


@dataclass(eq=False)
class ActuatorOutput:
    """Computes the command to the rate loop and the rotors, and learns the hover thrust."""

    _state: State
    """The autopilot's state; its ``attitude_target`` is written here."""
    _parameters: ParameterTable
    """The autopilot's parameters; MOT_THST_HOVER is written here."""
    _guided: Guided
    """The task of GUIDED; a take-off allows thrust on the ground."""
    _hold: PositionHold
    """The position hold, whose climb rate shows whether the vehicle hovers."""
    _to_throttle: Callable[[float], float]
    """Specific thrust, m/s^2 -> collective throttle of the rotors."""
    thrust: float = field(default=0.0, init=False)
    """Latest normalised thrust, 0..1, without the angle boost."""

    @property
    def taking_off(self) -> bool:
        """Whether a take-off in GUIDED is under way."""
        return self._state.mode is Mode.GUIDED and self._guided.task is Task.TAKE_OFF

    @property
    def cos_tilt(self) -> float:
        """Cosine of the angle between the body's down axis and the vertical."""
        return body_z(self._state.estimate.q)[2]

    def position_command(self, output: PositionOutput, dt: float) -> ActuatorCommand:
        """Return the command for the position controller's output of a period of ``dt`` s."""
        self.thrust = output.thrust
        self._learn_hover(output, dt)
        return self.attitude_command(output.q, output.thrust)

    def _learn_hover(self, output: PositionOutput, dt: float) -> None:
        """Move MOT_THST_HOVER towards the thrust of a level hover, if MOT_HOVER_LEARN is set."""
        state, parameters = self._state, self._parameters
        is_steady = (
            self._hold.climb_profile.rate == 0.0 and abs(state.estimate.velocity_ned[2]) < 0.6
        )
        if parameters["MOT_HOVER_LEARN"] and is_steady and self.cos_tilt > cos(radians(5.0)):
            hover_thrust = float(parameters["MOT_THST_HOVER"])
            change = dt / HOVER_LEARNING_TIME_S * (output.thrust - hover_thrust)
            parameters.set("MOT_THST_HOVER", hover_thrust + change)

    def attitude_command(self, target: Quaternion, thrust: float) -> ActuatorCommand:
        """Return the command that turns to an attitude, with ArduPilot's normalised thrust.

        ATTITUDE_TARGET reports `self.thrust`, which has no angle boost.
        """
        self._state.attitude_target.q = target
        self._state.attitude_target.thrust = self.thrust
        return self.rate_command(self.rates_towards(target), thrust)

    def rates_towards(self, target: Quaternion) -> Vector:
        """Return the body rates that turn to an attitude, rad/s."""
        return attitude_rates(self._state.estimate.q, target, 0.0, _ATTITUDE_GAINS)

    def rate_command(self, rates: Vector, thrust: float) -> ActuatorCommand:
        """Return the command for rates (rad/s) and normalised thrust.

        On the ground the thrust is 0, except during a take-off in GUIDED.
        """
        flying = not self._state.landed or self.taking_off
        throttle = self._to_throttle(specific_thrust(thrust)) if flying else 0.0
        return ActuatorCommand(True, *rates, throttle)
