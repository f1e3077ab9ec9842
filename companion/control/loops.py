"""Builds both loops from the configuration: the control loop and the guidance loop."""

from collections.abc import Callable

from companion.config import Config
from companion.control.control_loop import ControlLoop, SendSetpoint
from companion.control.guidance_loop import GuidanceLoop
from companion.control.inner_loop import hover_thrust, planner, rate_limits
from companion.control.loop_record import Deadlines
from companion.control.outer_loop import make_guidance, motion_estimate
from companion.control.telemetry import GuidedVehicle
from companion.guidance.braking import AssumedBraking
from companion.recording.trace import FlightTrace


def make_loops(
    config: Config,
    send: SendSetpoint,
    vehicle: GuidedVehicle,
    trace: FlightTrace,
    clock: Callable[[], float],
    clock_ns: Callable[[], int],
) -> tuple[ControlLoop, GuidanceLoop]:
    """Make the control loop, and the guidance loop that writes its commands.

    Args:
        config: configuration of the flight.
        send: sends setpoints.
        vehicle: what guidance reads of the vehicle.
        trace: receives the records of both loops.
        clock: returns event-loop time, s.
        clock_ns: clock for latencies, ns.

    Raises:
        ConfigError: a planner or guidance of another package cannot be loaded or made.
    """
    thrust = hover_thrust(config)
    limits, deadman = rate_limits(config), config.deadman
    deadlines = Deadlines(deadman.telemetry_stale, deadman.target_stale, deadman.deadline)
    loop = ControlLoop(planner(config), thrust, send, deadlines, trace, limits, clock, clock_ns)
    guidance_loop = GuidanceLoop(
        loop,
        make_guidance(config),
        motion_estimate(config, lambda: vehicle.clock.offset),
        thrust,
        vehicle,
        trace,
        max_tilt=config.limits.max_tilt,
        assumed_braking=AssumedBraking(config.safety.reaction_s, config.safety.braking_m_s2),
        period=1.0 / config.guidance.rate_hz,
        max_position_age=deadman.position_stale,
        clock=clock,
    )
    return loop, guidance_loop
