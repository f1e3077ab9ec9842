"""The values of a flight at one time for the live page, named as in `flight.mcap`."""

from math import hypot, isfinite
from typing import Any

from companion.attitude import coefficients
from companion.flight.context import FlightContext
from companion.guidance.reference import GRAVITY, Reference

_AXES = ("north", "east", "down")
_RATE_AXES = ("roll", "pitch", "yaw")


def view(context: FlightContext, now: float) -> dict[str, Any]:
    """The newest values, with the names and units of the channels of `flight.mcap`.

    Values that are not known are left out.
    """
    loop, guidance_loop, state = context.loop, context.guidance_loop, context.link.state
    values = {**_attitude(context, now), **_motion_values(context, now)}
    origin = context.snapshot_builder.fence_centre_ned
    if origin is not None:
        values.update(_with_axis_names("fence", origin, "m"))
    wind = guidance_loop.estimate.disturbance
    stats, round_trip = context.link.stats, context.link.timesync.round_trip_s
    values.update(
        wind_north_m_s2=wind[0],
        wind_east_m_s2=wind[1],
        height_m=state.height,
        hover_thrust=guidance_loop.learning.hover_thrust.learned_hover,
        frames=stats.frames,
        frames_lost=stats.lost,
        round_trip_ms=None if round_trip is None else 1e3 * round_trip,
        setpoints=loop.record.setpoints,
        unanswered=sum(loop.record.unanswered.values()),
        offboard_active=loop.offboard_active,
    )
    known_values = ((name, value) for name, value in values.items() if value is not None)
    return {
        name: round(value, 5) if isinstance(value, float) else value
        for name, value in known_values
        if isfinite(value)
    }


def _attitude(context: FlightContext, now: float) -> dict[str, float | None]:
    """Values of the newest sample, and of the target while setpoints are sent."""
    loop, values = context.loop, dict[str, float | None]()
    sample, command = loop.resets.newest_attitude, loop.command
    if sample is not None:
        north, east = coefficients(sample.q)
        values.update(zip(("q_w", "q_x", "q_y", "q_z"), sample.q, strict=True))
        values.update(measured_north=north, measured_east=east)
        values.update(_with_axis_names("measured", sample.body_rates, "rad_s", _RATE_AXES))
    if command is not None and loop.on:
        target = command.target_at(now)
        values.update(target_north=target.north, target_east=target.east)
        values.update(target_heading_rad=target.heading, thrust=loop.record.thrust)
    return values


def _motion_values(context: FlightContext, now: float) -> dict[str, float | None]:
    """Values of the estimated motion, and of the reference that is flown."""
    motion, height = context.guidance_loop.motion, context.link.state.height
    if motion is None:
        return {}
    values: dict[str, float | None] = {}
    values.update(_with_axis_names("estimated", motion.position_ned, "m"))
    values.update(_with_axis_names("estimated", motion.velocity_ned, "m_s"))
    reference = _reference(context, now)
    if reference is not None:
        values.update(_with_axis_names("reference", reference.position_ned, "m"))
        north, east, down = reference.acceleration_ned
        thrust = hypot(north, east, GRAVITY - down)
        if thrust > 0.0:  # in free fall no direction of the thrust is wanted
            values.update(reference_north=north / thrust, reference_east=east / thrust)
        if height is not None:
            height_difference = motion.position_ned[2] - reference.position_ned[2]
            values.update(reference_height_m=height + height_difference)
    return values


def _reference(context: FlightContext, now: float) -> Reference | None:
    """The reference that is flown; None: no reference, or the autopilot does not obey us."""
    guidance_loop = context.guidance_loop
    source, motion = guidance_loop.flown_source, guidance_loop.motion
    if not context.loop.offboard_active or source.pose is None or motion is None:
        return None
    return source.reference(now, motion, 0.0)(now)


def _with_axis_names(
    prefix: str, values: tuple[float, ...], unit: str, axes: tuple[str, ...] = _AXES
) -> dict[str, float]:
    names = (f"{prefix}_{axis}_{unit}" for axis in axes)
    return dict(zip(names, values, strict=True))
