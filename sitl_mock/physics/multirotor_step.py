"""One step of a multirotor in the air: rate loop, allocation, rotors and rigid body.

A step calls `drive`, then `move` in the air or `at_rest` on the ground. The functions are pure,
except that they change the ring buffers of delayed setpoints.
"""

from typing import NamedTuple

from sitl_mock.config.airframe import AirframeConfig
from sitl_mock.config.rate_loop import RateLoopConfig
from sitl_mock.physics.quaternion import Quaternion, Vector, rotated_slightly
from sitl_mock.physics.rate_loop import (
    ZERO_STATE,
    AxisStates,
    RateConstants,
    Ring,
    delay_setpoint,
    rate_constants,
    rate_step,
)
from sitl_mock.physics.rate_shaping import (
    INACTIVE_SHAPING,
    ShapingConstants,
    ShapingState,
    shape,
    shaping_constants,
)
from sitl_mock.physics.rigid_body import Load, Motion, RigidBody, advance, body_of, derivative
from sitl_mock.physics.rotors import (
    STOPPED_ALLOCATION,
    Allocation,
    FourFloats,
    RotorConstants,
    allocate,
    rotor_constants,
    rotor_step,
    steady_thrust,
    throttle_of,
)

ZERO: Vector = (0.0, 0.0, 0.0)


class MultirotorConstants(NamedTuple):
    """Constants of a multirotor under rate control."""

    rate_hz: float  # steps per second
    mass: float  # kg
    tilt_torque: float  # N m per throttle difference, about x and y
    yaw_torque: float  # N m per throttle difference, about z
    body: RigidBody
    rotors: RotorConstants
    rate_loop: RateConstants
    is_shaping: bool  # whether setpoints are shaped, by `shaping`
    shaping: ShapingConstants


Kinematics = tuple[Motion, Vector, Vector]
"""Motion after a step, and the means over the step: acceleration (NED, m/s^2), and angular
acceleration (FRD, rad/s^2)."""
Actuation = tuple[Allocation, FourFloats, AxisStates, ShapingState]
"""State of controller and rotors after a step: throttles, thrust of each rotor (N), rate loop,
shaping."""


class DelayRings(NamedTuple):
    """Ring buffers that delay setpoints; without shaping only `before_rate_loop` is used."""

    before_shaping: Ring
    """Latest setpoints received, in front of the shaping."""
    before_rate_loop: Ring
    """Latest setpoints in front of the rate loop, after the shaping if there is one."""


class Conditions(NamedTuple):
    """Slowly changing conditions, constant during the steps of one call."""

    thrust_factor: float
    """Factor of the battery voltage on the thrust of every rotor."""
    wind: Vector
    """Velocity of the air, NED, m/s."""
    attitude_error: Vector
    """Small rotation from the true to the estimated attitude, rad, NED."""


def multirotor_constants(
    airframe: AirframeConfig, rate_loop: RateLoopConfig
) -> MultirotorConstants:
    """Return the constants of an airframe with its rate controller."""
    dt = 1.0 / airframe.physics_rate_hz
    thrust_per_throttle = airframe.mass_kg * airframe.thrust_slope_m_s2
    return MultirotorConstants(
        float(airframe.physics_rate_hz),
        airframe.mass_kg,
        airframe.rotor_arm_m * thrust_per_throttle,
        airframe.rotor_drag_ratio_m * thrust_per_throttle,
        body_of(airframe),
        rotor_constants(airframe, dt),
        rate_constants(rate_loop, dt),
        rate_loop.shaping is not None,
        shaping_constants(rate_loop.shaping, dt),
    )


def steady_throttle(constants: MultirotorConstants, specific_thrust: float) -> float:
    """Return the collective throttle for a steady specific thrust (m/s^2), at most 1."""
    return throttle_of(constants.rotors, 0.25 * constants.mass * specific_thrust)


def initial_actuation(constants: MultirotorConstants, throttle: float) -> Actuation:
    """Return the state of controller and rotors at the start, with rotors at a steady speed."""
    thrust = steady_thrust(constants.rotors, throttle)
    allocation = allocate(throttle, 0.0, 0.0, 0.0)
    return allocation, (thrust, thrust, thrust, thrust), ZERO_STATE, INACTIVE_SHAPING


def empty_rings(constants: MultirotorConstants) -> DelayRings:
    """Return ring buffers of zero setpoints, longer than the delays."""
    return DelayRings(
        [ZERO] * (1 + max(constants.shaping.delays)), [ZERO] * (1 + max(constants.rate_loop.delays))
    )


def at_rest(q: Quaternion) -> Kinematics:
    """Return a body at rest with this attitude."""
    w, x, y, z = q
    return (0.0, 0.0, 0.0, w, x, y, z, 0.0, 0.0, 0.0), ZERO, ZERO


def drive(
    constants: MultirotorConstants,
    rings: DelayRings,
    actuation: Actuation,
    body: Kinematics,
    step: int,
    setpoint: Vector,
    throttle: float,
    controlled: bool,
    conditions: Conditions,
) -> tuple[Load, Actuation]:
    """Run controller, allocation and rotors for one step; return the load and the new actuation.

    Args:
        constants: constants of the multirotor.
        rings: ring buffers of the latest setpoints; changed in place.
        actuation: state of controller and rotors before the step.
        body: motion before the step.
        step: number of the step, one more with each call.
        setpoint: body rates, rad/s, FRD. NaN and infinity hold the present rate. If the setpoints
            are shaped, NaN holds the shaped rate, and infinity lets it grow without limit.
        throttle: collective throttle; NaN or <= 0 stops the rotors, values above 1 mean 1.
        controlled: whether the rate loop runs; otherwise it idles.
        conditions: battery, wind and attitude error; only the shaping uses the attitude error.
    """
    allocation, thrusts, axes, shaping = actuation
    motion, _, angular_acceleration = body
    _, _, _, w, x, y, z, p, q, r = motion
    if constants.is_shaping:
        estimated_q = rotated_slightly(conditions.attitude_error, (w, x, y, z))
        setpoint, shaping = _shape_setpoint(
            constants, rings, shaping, estimated_q, step, setpoint, controlled
        )
    setpoint = delay_setpoint(rings.before_rate_loop, constants.rate_loop.delays, step, setpoint)
    if controlled:
        _, tilt_saturated, yaw_saturated = allocation
        axes = rate_step(
            constants.rate_loop,
            axes,
            setpoint,
            (p, q, r),
            angular_acceleration,
            tilt_saturated,
            yaw_saturated,
        )
    else:
        axes = ZERO_STATE
    allocation = _allocate(constants, axes, throttle)
    thrusts, wrench = rotor_step(constants.rotors, thrusts, allocation[0], conditions.thrust_factor)
    return _load(constants, wrench, conditions.wind), (allocation, thrusts, axes, shaping)


def _shape_setpoint(
    constants: MultirotorConstants,
    rings: DelayRings,
    state: ShapingState,
    q: Quaternion,
    step: int,
    setpoint: Vector,
    controlled: bool,
) -> tuple[Vector, ShapingState]:
    """Return the delayed, shaped setpoint, and the state of the shaping after the step.

    If the rate loop does not run, the setpoint is returned unchanged.
    """
    delayed_setpoint = delay_setpoint(
        rings.before_shaping, constants.shaping.delays, step, setpoint
    )
    if controlled:
        return shape(constants.shaping, state, delayed_setpoint, q)
    return setpoint, INACTIVE_SHAPING


def _allocate(constants: MultirotorConstants, axes: AxisStates, throttle: float) -> Allocation:
    """Allocate torques and throttle to the rotors."""
    # A NaN throttle fails this comparison, which stops the rotors.
    if throttle > 0.0:
        roll, pitch, yaw = axes
        tilt_torque = constants.tilt_torque
        return allocate(
            throttle, roll[1] / tilt_torque, pitch[1] / tilt_torque, yaw[1] / constants.yaw_torque
        )
    return STOPPED_ALLOCATION


def _load(constants: MultirotorConstants, wrench: FourFloats, wind: Vector) -> Load:
    """Return the load on the body from thrust (N) and torques x, y, z (N m), with the wind."""
    thrust, torque_x, torque_y, torque_z = wrench
    wind_n, wind_e, wind_d = wind
    return thrust / constants.mass, torque_x, torque_y, torque_z, wind_n, wind_e, wind_d


def move(constants: MultirotorConstants, body: Kinematics, load: Load) -> tuple[Kinematics, Vector]:
    """Integrate one step under this load; return also the displacement, NED, m."""
    rate_hz = constants.rate_hz
    old_motion = body[0]
    vn, ve, vd, _, _, _, _, p, q, r = old_motion
    motion, displacement = advance(old_motion, load, constants.body, constants.rate_loop.dt)
    new_vn, new_ve, new_vd, _, _, _, _, new_p, new_q, new_r = motion
    acceleration = ((new_vn - vn) * rate_hz, (new_ve - ve) * rate_hz, (new_vd - vd) * rate_hz)
    angular_acceleration = ((new_p - p) * rate_hz, (new_q - q) * rate_hz, (new_r - r) * rate_hz)
    return (motion, acceleration, angular_acceleration), displacement


def does_not_rise(constants: MultirotorConstants, body: Kinematics, load: Load) -> bool:
    """Whether the body does not accelerate upward under this load."""
    return derivative(body[0], load, constants.body)[2] >= 0.0
