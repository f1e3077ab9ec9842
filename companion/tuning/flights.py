"""Flies a configuration on the mock vehicle, in this process, and measures the tracking errors."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import hypot, nan

import numpy as np

from companion.config import Config
from companion.config.files import changed, load, shipped
from companion.drag import NO_DRAG
from companion.recording.measurements.maneuver_figures import in_maneuvers
from companion.testing import MockVehicle, fly
from companion.testing.truth import TruthRecorder, true_positions
from companion.tuning.expectation import Floats

GUSTS: Mapping[str, float] = {"speed_m_s": 3.0, "gust_m_s": 1.0}
"""Wind of the trial flights in gusts: mean and standard deviation, m/s."""
_STRONG_GUST_SIGMAS = 2.0
"""Strength of a strong gust, in standard deviations of the gusts."""
_MAX_RESERVE_FRACTION = 0.8
"""Largest reserve for feedback and wind, as a share of the acceleration at the tilt limit."""
_MAX_THRUST = 0.95
_FENCE_SIZE = 50.0  # m
_MIN_MOVING_SPEED = 0.05
"""Speed above which the reference counts as moving, m/s."""
_DATAGRAM_DELAY_S = 0.0005
"""Delay of each datagram between program and mock vehicle, s."""
_QUICK_TAKEOFF_AND_LANDING = {
    "px4": {"MPC_TKO_RAMP_T": 0.3, "MPC_TKO_SPEED": 3.0, "MPC_LAND_SPEED": 3.0},
    "ardupilot": {"LAND_SPEED": 150.0},
}
"""Autopilot parameters that shorten take-off and landing."""


@dataclass(frozen=True, slots=True)
class TrialFlight:
    """A trajectory to fly on the mock vehicle, and the wind."""

    name: str
    """Name for the user."""
    trajectory: str
    """Name of a file in `configs/trajectories`."""
    wind: Mapping[str, float]
    """Section `wind` of the configuration of the mock vehicle."""


CIRCLE = TrialFlight("circle at 5 m/s", "circle5.yaml", {})
EIGHT = TrialFlight("figure-eight at 5 m/s", "figure8.yaml", {})
CIRCLE_IN_GUSTS = TrialFlight("circle in gusts", "circle5.yaml", GUSTS)
EIGHT_IN_GUSTS = TrialFlight("figure-eight in gusts", "figure8.yaml", GUSTS)
TRIAL_FLIGHTS = (CIRCLE, EIGHT, CIRCLE_IN_GUSTS, EIGHT_IN_GUSTS)


@dataclass(frozen=True, slots=True)
class TrialResult:
    """How well a trial flight was tracked; the figures are NaN if the flight failed.

    `companion tune --json` prints the attributes.

    Attributes:
        result: "ok", or why the flight ended early.
        reported: RMS horizontal distance of the estimated position from the reference, m.
        true: RMS horizontal distance of the true position from the reference, m.
        estimate: RMS horizontal distance of the estimated from the true position, m; no
            setting reduces this error.
        rate: RMS commanded roll-pitch rate, rad/s.
        rate_limited: share of the setpoints at the rate limit.
        speed: largest speed of the reference, m/s; below the planned one if slowed down.
        wind: mean wind, m/s; weaker than the trial's wind if the tilt limit requires so.
    """

    result: str
    reported: float = nan
    true: float = nan
    estimate: float = nan
    rate: float = nan
    rate_limited: float = nan
    speed: float = nan
    wind: float = 0.0

    @property
    def ok(self) -> bool:
        """Whether the trajectory was flown to its end."""
        return self.result == "ok"


def matching_autopilot(config: Config) -> str:
    """Autopilot of the mock vehicle: "ardupilot" if the roll rate has a slew limit, else "px4"."""
    roll = config.vehicle.axes["roll"]
    return "px4" if roll.acceleration_limit is None else "ardupilot"


def fly_trial(config: Config, trial: TrialFlight, autopilot: str, seed: int = 3) -> TrialResult:
    """Fly a trial on the mock vehicle, with the planner's configured gains, lag and dead time.

    The configured limits of tilt and tilt rate apply. The trajectory is slowed down if it would
    exceed these limits less a reserve for feedback and wind. Wind and gusts are scaled down if the
    tilt limit does not let the vehicle hold its position in the wind. Thrust and drag are set for
    the mock vehicle, take-off height and fence for the trial. No message is signed.

    Args:
        config: the configuration.
        trial: trajectory and wind.
        autopilot: autopilot of the mock vehicle, "px4" or "ardupilot".
        seed: seed of the noise and the gusts.

    Raises:
        ConfigError: the configuration cannot be flown on the mock vehicle.
    """
    mock_config = load(shipped(f"mock-{autopilot}.yaml"))
    parameters = (mock_config.mock or {}).get("parameters", {})
    trial = replace(trial, wind=_tolerable_wind(config, trial, mock_config))
    vehicle = MockVehicle(
        autopilot,
        lockstep=False,
        delay_s=_DATAGRAM_DELAY_S,
        prearm_delay_s=0.2,
        seed=seed,
        wind=dict(trial.wind),
        parameters={**parameters, **_QUICK_TAKEOFF_AND_LANDING[autopilot]},
    )
    flown_config = _flight_config(config, trial, mock_config)
    truth = TruthRecorder(vehicle)
    summary = fly(flown_config, vehicle)
    if summary.result != "ok":
        return TrialResult(summary.result)
    tracking = summary.trace.tracking.rows()
    maneuver_tracking = tracking[in_maneuvers(tracking[:, 0], summary.trace.maneuvers)]
    result = _tracking_figures(maneuver_tracking, truth.rows(), vehicle, flown_config)
    return replace(result, wind=trial.wind.get("speed_m_s", 0.0))


def _tracking_figures(
    tracking: Floats, truth: Floats, vehicle: MockVehicle, flown_config: Config
) -> TrialResult:
    """The tracking figures of a flight, over the time in which its reference moved.

    Args:
        tracking: rows of `FlightTrace.tracking` in the trial's maneuver.
        truth: see `TruthRecorder.rows`.
        vehicle: vehicle after the flight.
        flown_config: configuration of the flight.
    """
    time, reference = tracking[:, 0], tracking[:, 1:3]
    speed = np.hypot(*np.gradient(reference, time, axis=0).T)
    moving_indices = np.flatnonzero(speed > _MIN_MOVING_SPEED)
    moving_rows = slice(moving_indices[0], moving_indices[-1] + 1)
    true_position = true_positions(truth, time)[:, :2]
    tilt_rates = [
        hypot(*setpoint.rates[:2])
        for setpoint in vehicle.setpoints
        if time[moving_indices[0]] <= setpoint.time <= time[moving_indices[-1]]
    ]
    rates, max_tilt_rate = np.array(tilt_rates), flown_config.limits.max_tilt_rate
    return TrialResult(
        "ok",
        _rms(tracking[moving_rows, 4:6] - reference[moving_rows]),
        _rms(true_position[moving_rows] - reference[moving_rows]),
        _rms(true_position[moving_rows] - tracking[moving_rows, 4:6]),
        float(np.sqrt(np.mean(rates**2))),
        float(np.mean(rates > 0.99 * max_tilt_rate)),
        float(speed[moving_indices].max()),
    )


def _rms(offsets: Floats) -> float:
    return float(np.sqrt(np.mean(np.sum(offsets**2, axis=1))))


def _flight_config(config: Config, trial: TrialFlight, mock_config: Config) -> Config:
    """The configuration for a flight of the mock vehicle."""
    return changed(
        config,
        {
            "link": {"signing_key_file": None},
            "thrust": mock_config.thrust.model_dump(),
            "guidance": {
                "drag_per_s": mock_config.guidance.drag_per_s,
                "quadratic_drag_per_m": mock_config.guidance.quadratic_drag_per_m,
            },
            "limits": {
                "max_thrust": _MAX_THRUST,
                "fence_radius_m": _FENCE_SIZE,
                "fence_ceiling_m": _FENCE_SIZE,
                "fence_floor_m": 1.0,
            },
            "flight": {
                "arm": True,
                "maneuvers": ("trajectory",),
                "trajectory": shipped(f"trajectories/{trial.trajectory}"),
                "slow_down": True,
                "slow_down_reserve_m_s2": _acceleration_reserve(config, trial, mock_config),
                "takeoff_height_m": 5.0,
            },
        },
        "the flight on the mock vehicle",
    )


def _tolerable_wind(config: Config, trial: TrialFlight, mock_config: Config) -> Mapping[str, float]:
    """The wind of the trial, weakened if its drag would need too much of the tilt limit."""
    largest_deceleration = _MAX_RESERVE_FRACTION * config.limits.max_horizontal_acceleration
    wind_factor = min(1.0, largest_deceleration / max(_wind_deceleration(trial, mock_config), 1e-9))
    return {key: wind_factor * value for key, value in trial.wind.items()}


def _wind_deceleration(trial: TrialFlight, mock_config: Config) -> float:
    """Deceleration of a vehicle at rest by the drag in a strong gust, m/s²."""
    peak_wind = trial.wind.get("speed_m_s", 0.0) + _STRONG_GUST_SIGMAS * trial.wind.get(
        "gust_m_s", 0.0
    )
    deceleration, _, _ = (mock_config.guidance.drag or NO_DRAG).deceleration((peak_wind, 0.0, 0.0))
    return deceleration


def _acceleration_reserve(config: Config, trial: TrialFlight, mock_config: Config) -> float:
    """Horizontal acceleration that the trajectory must leave for feedback and wind drag, m/s²."""
    largest_reserve = _MAX_RESERVE_FRACTION * config.limits.max_horizontal_acceleration
    return min(
        config.flight.slow_down_reserve_m_s2 + _wind_deceleration(trial, mock_config),
        largest_reserve,
    )
