"""Summary of a finished flight: printed by `--json` and kept in the log folder."""

import json
import math
from dataclasses import asdict, dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from companion.attitude.kinematics import tilt_angle
from companion.recording.mcap_file.channels import MOTION
from companion.recording.mcap_file.loop_channels import rate_names
from companion.recording.measurements.dead_time import DeadTimes
from companion.recording.measurements.flight_facts import FlightFacts
from companion.recording.measurements.maneuver_figures import (
    Floats,
    ManeuverFigures,
    in_maneuvers,
    largest,
    measure_maneuvers,
    rms,
    without_nan,
)
from companion.recording.measurements.response import (
    StepResponse,
    measure_response,
    response_as_dict,
)
from companion.recording.measurements.verdict import checks, is_good
from companion.recording.trace import RATE_COLUMNS, FlightTrace

_ROLL_AND_PITCH = [
    RATE_COLUMNS.index(name) for name in ("vehicle_time_s", *rate_names("measured")[:2])
]
_HEIGHT, _SPEED, _TILT = map(MOTION.columns.index, ("height_m", "speed_m_s", "tilt_deg"))


@dataclass(frozen=True, slots=True)
class LoopCounts:
    """Counts of the control loop, under the names of `--json`."""

    samples: int = 0
    """Attitude samples received while control was switched on."""
    setpoints: int = 0
    """Setpoints sent."""
    missed_deadlines: int = 0
    """Setpoints sent more than `deadman.deadline_ms` after their sample arrived."""
    stale: int = 0
    """Samples not answered for other reasons than `refused`: the sample or the target was too old
    or out of order, there was no target, the mode was not confirmed after a gap, or the sample may
    come from another vehicle."""
    refused: int = 0
    """Samples not answered because no valid setpoint could be computed or sent."""
    unanswered: dict[str, int] = field(default_factory=dict)
    """Unanswered samples, by reason."""
    rate_hz: float = 0.0
    """Rate of setpoints during the maneuvers, Hz."""


@dataclass(frozen=True, slots=True)
class PredictiveFigures:
    """Counts and times of predictive control."""

    used_answers: int
    """Number of answers of the solver that guidance used."""
    unused_answers: dict[str, int]
    """Number of answers of the solver that guidance did not use, by reason."""
    computing_seconds: tuple[float, ...]
    """Computing time in the solver's process of each answer that was used, s."""

    def as_dict(self) -> dict[str, Any]:
        """The figures as JSON, in milliseconds."""
        seconds, flown = self.computing_seconds, self.used_answers
        p50, p99 = np.percentile(seconds, (50, 99)) if seconds else (math.nan, math.nan)
        times = {"p50": 1e3 * float(p50), "p99": 1e3 * float(p99)}
        return {"flown": flown, "troubles": self.unused_answers, "solve_ms": without_nan(times)}


@dataclass(frozen=True)
class Summary:
    """The summary of a finished flight."""

    result: str
    """"ok", or the reason why the flight ended early."""
    phase: str
    """The phase that failed; the last phase if none failed."""
    planner: str
    gain: float
    """Gain p of the planner, 1/s."""
    counts: LoopCounts
    link: dict[str, int]
    """Frames received, lost, damaged and so on, by name."""
    trace: FlightTrace
    events: list[tuple[float, str]] = field(default_factory=list)
    """(s since the flight began, text) of each event."""
    log: Path | None = None
    """The flight's folder."""
    dead_times: DeadTimes = field(default_factory=DeadTimes)
    predictive: PredictiveFigures | None = None
    """Figures of predictive control; None: predictive control did not fly."""
    realtime: dict[str, str] = field(default_factory=dict)
    """Each real-time request to the operating system: "granted", or the reason why not."""
    facts: FlightFacts = field(default_factory=FlightFacts)

    def response(self) -> StepResponse | None:
        """The measured step response; None without steps."""
        return self._response

    @cached_property
    def _response(self) -> StepResponse | None:
        return measure_response(self.trace.response.rows(), self.gain)

    def latency_us(self) -> dict[str, float]:
        """Latency from sample to setpoint in this process: p50, p99 and maximum, µs."""
        latencies = self.trace.latencies_ns.rows()[:, 0] / 1e3
        if len(latencies) == 0:
            return {"p50": math.nan, "p99": math.nan, "max": math.nan}
        p50, p99 = np.percentile(latencies, (50, 99))
        return {"p50": float(p50), "p99": float(p99), "max": float(latencies.max())}

    def tracking(self) -> dict[str, float]:
        """Errors of position and height under control, m: see `tracking_errors`."""
        return tracking_errors(self.trace.tracking.rows())

    def maneuvers(self) -> tuple[ManeuverFigures, ...]:
        """The figures of each maneuver that was flown, in order."""
        return self._maneuvers

    @cached_property
    def _maneuvers(self) -> tuple[ManeuverFigures, ...]:
        trace = self.trace
        rates = trace.rates.rows()[:, _ROLL_AND_PITCH]
        return measure_maneuvers(
            trace.tracking.rows(), rates, trace.maneuvers, self.facts.start_time
        )

    def extent(self) -> dict[str, float]:
        """The largest height (m), speed (m/s) and tilt (°), and the time under control (s).

        Speed and tilt are given for the whole flight and for its maneuvers, from rows recorded ten
        times a second; during steps, the tilt comes from every sample.
        """
        motion_rows, tracking_rows = self.trace.motion.rows(), self.trace.tracking.rows()
        maneuver_rows = motion_rows[in_maneuvers(motion_rows[:, 1], self.trace.maneuvers)]
        tilts = np.degrees([tilt_angle(row[2], row[3]) for row in self.trace.response.rows()])
        times = tracking_rows[:, 0].tolist()
        return {
            "height_max_m": _largest_known(motion_rows[:, _HEIGHT]),
            "speed_max_m_s": _largest_known(motion_rows[:, _SPEED]),
            "tilt_max_deg": _largest_known(motion_rows[:, _TILT], tilts),
            "maneuver_speed_max_m_s": _largest_known(maneuver_rows[:, _SPEED]),
            "maneuver_tilt_max_deg": _largest_known(maneuver_rows[:, _TILT], tilts),
            "under_control_s": times[-1] - times[0] if times else 0.0,
        }

    def as_dict(self) -> dict[str, Any]:
        """The content of `--json`; null for values that were not measured."""
        figures = {
            "result": self.result,
            "phase": self.phase,
            "planner": self.planner,
            "gain_per_s": self.gain,
            **asdict(self.counts),
            "latency_us": without_nan(self.latency_us()),
            "response": response_as_dict(self.response()),
            "dead_time_s": _dead_times_as_dict(self.dead_times),
            "tracking": without_nan(self.tracking()),
            "maneuvers": [figures.as_dict() for figures in self.maneuvers()],
            "extent": without_nan(self.extent()),
            "nmpc": None if self.predictive is None else self.predictive.as_dict(),
            "realtime": self.realtime,
            "link": self.link,
            **self.facts.as_dict(),
            "events": [{"time_s": round(time, 3), "text": text} for time, text in self.events],
            "log": None if self.log is None else str(self.log),
        }
        check_dicts = [check._asdict() for check in checks(figures)]
        return {**figures, "verdict": {"good": is_good(figures), "checks": check_dicts}}

    def as_json(self) -> str:
        """`as_dict` on one line."""
        return json.dumps(self.as_dict(), allow_nan=False)


def tracking_errors(rows: Floats) -> dict[str, float]:
    """RMS and largest position error, and RMS height error, m.

    `rows` are the (N, 7) rows of `FlightTrace.tracking`; those without a reference position or
    height do not count. NaN: no row counts.
    """
    error = rows[:, 4:7] - rows[:, 1:4]
    distance = np.linalg.norm(error[~np.isnan(error).any(axis=1)], axis=1)
    return {
        "position_rms_m": rms(distance),
        "position_max_m": largest(distance),
        "height_rms_m": rms(error[~np.isnan(error[:, 2]), 2]),
    }


def _dead_times_as_dict(dead_times: DeadTimes) -> dict[str, float | None]:
    age = dead_times.sample_age
    return {
        **{name: axis.measured for name, axis in dead_times.axes.items()},
        **without_nan({"sample_age_p50": age.p50, "sample_age_p99": age.p99}),
    }


def _largest_known(*columns: Floats) -> float:
    """The largest number of all columns (n,); NaN: they contain none."""
    values = np.concatenate(columns)
    return largest(values[~np.isnan(values)])
