"""Measures the disturbances of a recorded flight from its telemetry: estimator errors and gusts."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from companion.attitude.kinematics import half_tilt_products
from companion.guidance import GRAVITY
from companion.mavlink.tlog_file import messages
from companion.tuning.expectation import Disturbances, Floats
from companion.vehicle.registry import AUTOPILOTS

_POSITION_HOLD_BAND = 0.15, 1.5
"""Range of frequencies at which position hold responds to disturbances, Hz."""
_NOISE_ONLY_NYQUIST_FRACTION = 0.6
"""Share of the telemetry's Nyquist frequency above which a spectrum contains only the noise of
single messages."""
_SEGMENT_DURATION = 8.0
"""Duration of the segments of the record whose spectra are computed, s."""
_MIN_HEIGHT = 1.0
"""Height above the first position of the log below which telemetry is left out, m."""
_AUTOPILOT_NUMBERS = {autopilot.mav_autopilot for autopilot in AUTOPILOTS}


def measured_disturbances(
    log: Path, drag: float, default: Disturbances, on_damage: Callable[[str], object] | None = None
) -> Disturbances:
    """The disturbances in flight, measured in a `.tlog`.

    `velocity_density` is measured from the change of position that is not due to the velocity,
    `acceleration_density` from the change of velocity that is not due to tilt and drag.
    `acceleration_density` includes gusts.

    Args:
        log: a `.tlog` of this or another program.
        drag: linear drag of the vehicle, 1/s.
        default: disturbances that supply what a log does not show: gusts and the errors on a path.
            `default` is returned unchanged if the log has too little flight.
        on_damage: called with a sentence if damaged records of the log were left out.

    Raises:
        LogError: the file cannot be read or is not a `.tlog`.
    """
    motion, thrust_slopes = _telemetry(log, on_damage)
    if len(motion) < 2 or len(thrust_slopes) < 2:
        return default
    time, position, velocity = motion[:, 0], motion[:, 1:3], motion[:, 3:5]
    period = np.diff(time)[:, None]
    mean_thrust_slope = np.diff(_integral(time, thrust_slopes), axis=0) / period
    mean_velocity = 0.5 * (velocity[1:] + velocity[:-1])
    unexplained_velocity = np.diff(position, axis=0) / period - mean_velocity
    unexplained_acceleration = (
        np.diff(velocity, axis=0) / period - GRAVITY * mean_thrust_slope + drag * mean_velocity
    )
    velocity_density, position_noise = _densities(time[1:], unexplained_velocity)
    acceleration_density, velocity_noise = _densities(time[1:], unexplained_acceleration)
    if not np.isfinite([velocity_density, acceleration_density]).all():
        return default
    return replace(
        default,
        velocity_density=velocity_density,
        acceleration_density=acceleration_density,
        position_noise=position_noise,
        velocity_noise=velocity_noise,
        source=log.parent.name or log.name,
    )


def _telemetry(log: Path, on_damage: Callable[[str], object] | None) -> tuple[Floats, Floats]:
    """Motion (n, 5): time, position and velocity north and east; slopes (m, 3): time, north, east.

    The times are in s. A slope is the horizontal part of the thrust divided by its vertical part.
    """
    vehicle: tuple[int, int] | None = None
    motion: list[tuple[float, ...]] = []
    thrust_slopes: list[tuple[float, ...]] = []
    first_down = None
    message_names = {"HEARTBEAT", "LOCAL_POSITION_NED", "ATTITUDE_QUATERNION"}
    for frame, message in messages(log, message_names, on_damage):
        source, message_type = (frame.system, frame.component), message.get_type()
        if message_type == "HEARTBEAT":
            if vehicle is None and message.autopilot in _AUTOPILOT_NUMBERS:
                vehicle = source
            continue
        if source != vehicle:
            continue
        time = 1e-3 * message.time_boot_ms
        if message_type == "ATTITUDE_QUATERNION":
            a_squared, ax, ay = half_tilt_products(message.q1, message.q2, message.q3, message.q4)
            cosine = max(2.0 * a_squared - 1.0, 0.2)
            thrust_slopes.append((time, -2.0 * ay / cosine, 2.0 * ax / cosine))
            continue
        first_down = message.z if first_down is None else first_down
        if first_down - message.z > _MIN_HEIGHT and (not motion or time > motion[-1][0]):
            motion.append((time, message.x, message.y, message.vx, message.vy))
    return np.array(motion).reshape(-1, 5), np.array(thrust_slopes).reshape(-1, 3)


def _integral(time: Floats, thrust_slopes: Floats) -> Floats:
    """Integral of the thrust slopes from their first time to each `time`, (n, 2), s.

    `time`: (n,), s. `thrust_slopes`: (m, 3), time (s) and slopes, as from `_telemetry`.
    """
    steps = np.diff(thrust_slopes[:, 0], prepend=thrust_slopes[0, 0])[:, None]
    integrals = np.cumsum(steps * thrust_slopes[:, 1:], axis=0)
    return np.column_stack([np.interp(time, thrust_slopes[:, 0], each) for each in integrals.T])


def _densities(time: Floats, residual: Floats) -> tuple[float, float]:
    """Spectral density of a residual without measurement noise, and noise of one measurement.

    The density is an amplitude spectral density, averaged over `_POSITION_HOLD_BAND`, in units
    of the residual per √Hz. The noise is a standard deviation. If the record is too short, the
    density and the noise are NaN.

    Args:
        time: (n,), s.
        residual: (n, 2), north and east: unexplained change of a measurement from one message to
            the next, divided by the time between them.
    """
    period = float(np.median(np.diff(time)))
    length = round(_SEGMENT_DURATION / period)
    gaps = np.flatnonzero(np.diff(time) > 3.0 * period)
    band_levels, noise_levels = [], []
    for gapless_residual in np.split(residual, gaps + 1):
        for begin in range(0, len(gapless_residual) - length + 1, max(1, length // 2)):
            segment = gapless_residual[begin : begin + length]
            window = np.hanning(length)[:, None]
            spectrum = np.abs(np.fft.rfft((segment - segment.mean(axis=0)) * window, axis=0)) ** 2
            density = 2.0 * period * spectrum / np.sum(window**2)
            frequencies = np.fft.rfftfreq(length, period)
            band_levels.append(
                density[
                    (frequencies >= _POSITION_HOLD_BAND[0])
                    & (frequencies <= _POSITION_HOLD_BAND[1])
                ].mean()
            )
            is_high = frequencies >= _NOISE_ONLY_NYQUIST_FRACTION * frequencies[-1]
            # Differencing over a period amplifies the noise of single messages by this gain.
            noise_gain = (2.0 * np.sin(np.pi * frequencies[is_high] * period) / period) ** 2
            noise_levels.append((density[is_high].mean(axis=1) / noise_gain).mean())
    if not band_levels:
        return float("nan"), float("nan")
    noise_level = float(np.median(noise_levels))
    # The noise of single messages belongs to the measurement, not to the motion.
    band_middle = 0.5 * (_POSITION_HOLD_BAND[0] + _POSITION_HOLD_BAND[1])
    motion_density = max(
        float(np.median(band_levels)) - noise_level * (2.0 * np.pi * band_middle) ** 2, 0.0
    )
    return float(np.sqrt(motion_density)), float(np.sqrt(noise_level / (2.0 * period)))
