"""Puts a flight together from the configuration: the one place where YAML's units become SI."""

import asyncio
from collections.abc import Callable
from dataclasses import dataclass
from math import radians, tan
from pathlib import Path

from companion.attitude import Limits, Planner, make_planner
from companion.attitude.planner import MODEL_FOLLOWING
from companion.config import Config
from companion.flight.control_loop import ControlLoop, Deadlines
from companion.flight.flight import AskLanding, Flight
from companion.flight.guide import Guide
from companion.flight.observer import Observer
from companion.flight.rig import Rig
from companion.flight.safety import Fence, SafetyMonitors
from companion.flight.watch import Watch
from companion.guidance import (
    Circle,
    Corners,
    HoldGains,
    Hover,
    HoverThrust,
    PositionHold,
    Programme,
    Sequence,
    Steps,
)
from companion.guidance.reference import GRAVITY
from companion.mavlink.link import Link
from companion.mavlink.settings import LinkSettings
from companion.mavlink.signing import Signing, key_from_passphrase_file
from companion.recording.summary import LoopCounts
from companion.recording.trace import FlightTrace

_MS = 1e-3


def link_settings(config: Config) -> LinkSettings:
    """The link's settings; reads the signing key, if there is one.

    Raises:
        SigningError: the key cannot be used.
    """
    link = config.link
    return LinkSettings(
        endpoint=link.endpoint,
        target_system=link.target_system,
        target_component=link.target_component,
        source_system=link.source_system,
        source_component=link.source_component,
        signing=_signing(link.signing_key_file),
        lockstep=link.lockstep,
    )


def _signing(key_file: Path | None) -> Signing | None:
    return None if key_file is None else Signing(key_from_passphrase_file(key_file))


def planner(config: Config) -> Planner:
    """The planner with its limits, and with the vehicle's response if it plans with that."""
    limits = config.limits
    response: dict[str, float] = {}
    if config.planner.name == MODEL_FOLLOWING:
        times = config.vehicle.model_dump(exclude_none=True)
        response = {key.removesuffix("_ms"): 1e-3 * value for key, value in times.items()}
    return make_planner(
        config.planner.name,
        gain=config.planner.gain_per_s,
        yaw_gain=config.planner.yaw_gain_per_s,
        limits=Limits(
            max_tilt=radians(limits.max_tilt_deg),
            max_tilt_rate=radians(limits.max_tilt_rate_deg_s),
            max_yaw_rate=radians(limits.max_yaw_rate_deg_s),
            shape=limits.rate_limit,
        ),
        recovery_angle=radians(limits.recovery_angle_deg),
        **response,
    )


def programme(config: Config) -> Sequence:
    """The programmes of `flight.programme`, one after the other."""
    known: dict[str, Programme] = {
        "hover": Hover(config.hover.duration_s),
        "corners": Corners(
            config.corners.coefficient, config.corners.duration_s, config.corners.settle_s
        ),
        "steps": Steps(config.steps.coefficient, config.steps.duration_s, config.steps.settle_s),
        "circle": Circle(config.circle.radius_m, config.circle.speed_m_s, config.circle.laps),
    }
    return Sequence([known[name] for name in config.flight.programme])


def hover_thrust(config: Config) -> HoverThrust:
    """The map from specific thrust to 0..1."""
    return HoverThrust(
        config.thrust.hover_thrust,
        config.thrust.correction_limit,
        config.thrust.correction_time_s,
        config.limits.min_thrust,
        config.limits.max_thrust,
    )


def position_hold(config: Config) -> PositionHold:
    """The outer loop; in a hover it asks for no more than the tilt limit gives."""
    gains, limits = config.guidance, config.limits
    return PositionHold(
        HoldGains(
            position=gains.position_gain_per_s2,
            velocity=gains.velocity_gain_per_s,
            height=gains.height_gain_per_s,
            climb=gains.climb_gain_per_s,
            drag=gains.drag_per_s,
            max_climb=limits.max_climb_m_s,
            max_descent=limits.max_descent_m_s,
            max_horizontal=GRAVITY * tan(radians(limits.max_tilt_deg)),
        )
    )


@dataclass(frozen=True, slots=True)
class Assembled:
    """A flight ready to run over an open link, and what is read from it afterwards."""

    flight: Flight
    rig: Rig
    trace: FlightTrace

    def counts(self) -> LoopCounts:
        """What the control loop counted."""
        loop = self.rig.loop
        return LoopCounts(
            samples=loop.samples,
            setpoints=loop.setpoints,
            missed_deadlines=loop.missed_deadlines,
            stale=loop.stale,
            refused=loop.refused,
            rate_hz=self.rig.rate_hz,
        )


def assemble(config: Config, link: Link, observer: Observer, ask_landing: AskLanding) -> Assembled:
    """Wire the rooms together over an open link."""
    clock: Callable[[], float] = asyncio.get_running_loop().time
    trace = FlightTrace()
    thrust = hover_thrust(config)
    deadman = config.deadman
    loop = ControlLoop(
        planner(config),
        thrust,
        link.send_setpoint,
        Deadlines(
            telemetry_stale=deadman.telemetry_stale_ms * _MS,
            target_stale=deadman.target_stale_ms * _MS,
            deadline=deadman.deadline_ms * _MS,
        ),
        trace,
    )
    guide = Guide(
        loop,
        position_hold(config),
        thrust,
        link.state,
        trace,
        period=1.0 / config.guidance.rate_hz,
        position_stale=deadman.position_stale_ms * _MS,
        clock=clock,
    )
    limits = config.limits
    monitors = SafetyMonitors(
        link.state,
        Fence(limits.fence_radius_m, limits.fence_ceiling_m, limits.fence_floor_m),
        limits.min_battery_percent / 100.0,
        clock,
    )
    rig = Rig(config, link, loop, guide, monitors, programme(config))
    watch = Watch(rig, silence_limit=deadman.silence_limit_ms * _MS, clock=clock)
    loop.ask_mode = watch.ask_mode
    return Assembled(Flight(rig, watch, observer, ask_landing), rig, trace)
