"""Puts a flight together from the configuration: the one place where YAML's units become SI."""

import asyncio
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from companion.attitude import Limits, Planner, make_planner
from companion.attitude.planner import MODEL_FOLLOWING
from companion.config import Config
from companion.config.known_drag import drag_prior
from companion.control.control_loop import ControlLoop, Deadlines
from companion.control.ground_contact import GroundContact
from companion.control.guidance_loop import GuidanceLoop
from companion.control.outer_loop import linear_guidance, motion_estimate, predictive
from companion.flight.asking_again import AskingAgain
from companion.flight.context import FlightContext
from companion.flight.dead_time_watch import DeadTimeWatch, RateLoop
from companion.flight.flight import AskLanding, Flight
from companion.flight.judgement import Preflight
from companion.flight.maneuvers import unbegun
from companion.flight.observer import Observer
from companion.flight.same_vehicle import SameVehicle
from companion.flight.snapshot_builder import SnapshotBuilder
from companion.flight.vehicle_memory import VehicleMemory
from companion.flight.watch import Watch
from companion.guidance import HoverThrust, ManeuverSequence, ThrustSettings
from companion.guidance.follow import Follow
from companion.mavlink.frame_filter import Notice
from companion.mavlink.settings import LinkSettings
from companion.mavlink.signing import Signing, key_from_passphrase_file
from companion.mavlink.stamp_file import StampFile
from companion.mavlink.transport.base import Tap
from companion.realtime import Wishes
from companion.recording.summary import LoopCounts, PredictiveFigures
from companion.recording.trace import FlightTrace
from companion.safety import SafetyLadder, monitors
from companion.vehicle.link import Link


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


def open_link(config: Config, tap: Tap | None, notice: Notice) -> Link:
    """The link that `link.backend` names, not open yet; `tap` and `notice` as of `Link`.

    Raises:
        SigningError: the key cannot be used.
        EndpointError: the endpoint's notation is wrong.
    """
    settings = link_settings(config)
    if config.link.backend == "mavsdk":
        from companion.mavsdk_link.link import MavsdkLink  # noqa: PLC0415  needs the extra

        return MavsdkLink(settings, tap, notice)
    return Link(settings, tap, notice=notice)


def realtime_wishes(config: Config) -> Wishes:
    """What to ask of the operating system."""
    section = config.realtime
    return Wishes(
        fifo_priority=section.priority if section.scheduler == "fifo" else None,
        processors=section.cpu_affinity,
        lock_memory=section.lock_memory,
        freeze_gc=section.freeze_gc,
        required=section.required,
    )


def _signing(key_file: Path | None) -> Signing | None:
    if key_file is None:
        return None
    key = key_from_passphrase_file(key_file)
    return Signing(key, file=StampFile(key))


def planner(config: Config) -> Planner:
    """The planner with its limits, and with the vehicle's response if it plans with that."""
    following = config.planner_name == MODEL_FOLLOWING
    return make_planner(
        config.planner_name,
        gain=config.planner.gain_per_s,
        yaw_gain=config.planner.yaw_gain_per_s,
        limits=rate_limits(config),
        recovery_angle=config.limits.recovery_angle,
        **(config.vehicle.response if following else {}),
    )


def rate_loops(config: Config) -> tuple[RateLoop, RateLoop, RateLoop]:
    """What `vehicle` says of roll, pitch and yaw."""
    roll, pitch, yaw = (
        RateLoop(axis.lag, axis.dead_time, axis.acceleration_limit, axis.damping)
        for axis in config.vehicle.axes.values()
    )
    return roll, pitch, yaw


def rate_limits(config: Config) -> Limits:
    """What we never ask of the vehicle, whoever asks."""
    limits = config.limits
    return Limits(
        max_tilt=limits.max_tilt,
        max_tilt_rate=limits.max_tilt_rate,
        max_yaw_rate=limits.max_yaw_rate,
        shape=limits.rate_limit,
    )


def hover_thrust(config: Config) -> HoverThrust:
    """The map from specific thrust to 0..1."""
    thrust = config.thrust
    return HoverThrust(
        ThrustSettings(
            hover=thrust.hover_thrust,
            correction_limit=thrust.correction_limit,
            correction_time=thrust.correction_time_s,
            lowest=config.limits.min_thrust,
            highest=config.limits.max_thrust,
            curve_factor=thrust.curve_factor,
            battery_exponent=thrust.battery_exponent,
            lag=thrust.lag,
            tilt_compensated=thrust.autopilot_compensates_tilt,
            drag=drag_prior(config).drag.linear,
        )
    )


@dataclass(frozen=True, slots=True)
class Assembled:
    """A flight ready to run over an open link, and what is read from it afterwards."""

    flight: Flight
    context: FlightContext
    trace: FlightTrace
    dead_time_watch: DeadTimeWatch
    memory: VehicleMemory

    def close(self) -> None:
        """End what runs beside the flight."""
        if self.context.guidance_loop.predictive is not None:
            self.context.guidance_loop.predictive.close()

    def predictive_figures(self) -> PredictiveFigures | None:
        """What came of predictive control; None where it did not fly."""
        predictive = self.context.guidance_loop.predictive
        if predictive is None:
            return None
        record = predictive.record
        troubles = {trouble.value: count for trouble, count in record.troubles.items()}
        return PredictiveFigures(record.flown, troubles, tuple(record.seconds))

    def counts(self) -> LoopCounts:
        """What the control loop counted."""
        record = self.context.loop.record
        return LoopCounts(
            samples=record.samples,
            setpoints=record.setpoints,
            missed_deadlines=record.missed_deadlines,
            stale=record.stale,
            refused=record.refused,
            unanswered={reason.value: count for reason, count in record.unanswered.items()},
            rate_hz=self.context.rate_hz,
        )


def assemble(
    config: Config,
    link: Link,
    observer: Observer,
    ask_landing: AskLanding,
    folder: Path,
    maneuvers: ManeuverSequence,
) -> Assembled:
    """Wire the rooms together over an open link, to fly `maneuvers`.

    What is noted in flight waits in `folder`.
    """
    clock: Callable[[], float] = asyncio.get_running_loop().time
    trace = FlightTrace(folder)
    thrust = hover_thrust(config)
    deadman = config.deadman
    loop = ControlLoop(
        planner(config),
        thrust,
        link.send_setpoint,
        Deadlines(
            telemetry_stale=deadman.telemetry_stale,
            target_stale=deadman.target_stale,
            deadline=deadman.deadline,
        ),
        trace,
        rate_limits(config),
        clock,
    )
    ground = GroundContact(link.state, clock)
    guidance_loop = GuidanceLoop(
        loop,
        linear_guidance(config),
        motion_estimate(config, lambda: link.clock.offset),
        thrust,
        link.state,
        ground,
        trace,
        max_tilt=config.limits.max_tilt,
        period=1.0 / config.guidance.rate_hz,
        position_stale=deadman.position_stale,
        clock=clock,
        vehicle_clock=link.clock,
    )
    snapshot_builder = SnapshotBuilder(
        link, loop, guidance_loop, real_time=not config.link.lockstep
    )
    same_vehicle = SameVehicle(link, clock)
    loop.is_same_vehicle = lambda: same_vehicle.same
    loop.planner.attitude_target = lambda: link.state.attitude_target
    preflight = Preflight(config, link, same_vehicle, unbegun(maneuvers))
    context = FlightContext(
        config,
        link,
        loop,
        guidance_loop,
        snapshot_builder,
        maneuvers,
        ground,
        preflight,
        same_vehicle,
    )
    ladder = SafetyLadder(monitors(config), config.safety.hold_s)
    asking_again = AskingAgain(link, config.link)
    watch = Watch(context, ladder, asking_again, clock)
    loop.ask_mode = watch.ask_mode
    flight = Flight(context, watch, observer, ask_landing)
    ladder.note = context.note = preflight.note = flight.note
    link.clock.on_event = asking_again.note = flight.note
    drag_is_told = config.guidance.drag is not None
    memory = VehicleMemory(folder.parent, guidance_loop.estimate.drag, drag_is_told, flight.note)
    preflight.meet = memory.meet
    for part in context.maneuvers.parts:
        if isinstance(part, Follow):
            if part.slowed > 1.0:
                flight.note(f"{part.name} is slowed down {part.slowed:.2f} times for the limits")
            if config.guidance.kind == "nmpc":
                guidance_loop.predictive = predictive(config, part, flight.note)
    dead_time_watch = DeadTimeWatch(trace, rate_loops(config), flight.note)
    return Assembled(flight, context, trace, dead_time_watch, memory)
