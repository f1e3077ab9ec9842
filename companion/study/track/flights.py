"""The flights of the study `track`: the mock vehicle follows trajectories in lockstep."""

import os
import tempfile
from collections.abc import Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from math import inf
from multiprocessing import get_context
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from companion.batch import can_compile
from companion.child_process import end_with_parent, interrupts_blocked, usable_cores
from companion.config import Config
from companion.config.files import changed, load, shipped
from companion.files import bounded_yaml
from companion.recording.measurements.maneuver_figures import in_maneuvers
from companion.study.outcome import Tick
from companion.study.step import Floats
from companion.study.track.tasks import Task
from companion.testing import MockVehicle
from companion.testing import fly as fly_in_memory
from companion.testing.truth import TruthRecorder, true_positions

POSITION_RATE_HZ = 30.0
MAX_TILT_DEG, MAX_TILT_RATE_DEG_S, MAX_THRUST = 58.0, 250.0, 0.98
"""Limits of the flights. On the circle at 7 m/s drag makes 51° of tilt necessary, and wind more."""
GUST_SHARE = 1.0 / 3.0
"""Standard deviation of the gusts north and east, as a share of the mean wind."""
HOVER_S = 2.0
"""Duration of the hover before the trajectory, s."""
_HEIGHT_M = 3.0
_QUICK_TAKEOFF_AND_LANDING = {
    "prearm_delay_s": 0.2,
    "parameters": {
        "COM_DISARM_LAND": 0.2,
        "COM_SPOOLUP_TIME": 0.1,
        "MPC_LAND_SPEED": 2.0,
        "MPC_TKO_RAMP_T": 0.3,
        "MPC_TKO_SPEED": 3.0,
    },
}
"""Vehicle settings that shorten take-off and landing."""


class PositionError(NamedTuple):
    """Distance of a position from the reference over a trajectory, m."""

    rms: float
    largest: float


class TrackedFlight(NamedTuple):
    """The result of a flight; the errors of a failed flight are infinite."""

    result: str
    """`ok`, or why the flight ended."""
    telemetry_error: PositionError
    """Distance between the position that guidance received and the reference, m."""
    true_error: PositionError
    """Distance of the vehicle's true position from the reference, m."""
    path: Floats
    """(n, 4), reference north and east, true north and east, m."""


TrackedFlights = dict[Task, TrackedFlight]


def fly_all(tasks: Sequence[Task], tick: Tick) -> TrackedFlights:
    """Fly every task, one flight on each CPU core at a time; call `tick` before each flight.

    The result of a flight does not depend on other flights. On Ctrl-C this function waits for the
    flights in progress, so that no process is left behind.

    Raises:
        ConfigError: raised by a flight, see `fly`; no further flights are begun.
    """
    core_count = usable_cores()
    futures: dict[Task, Future[TrackedFlight]] = {}
    workers = min(core_count, len(tasks))
    spawn_context = get_context("spawn")
    with ProcessPoolExecutor(workers, spawn_context, end_with_parent, (os.getpid(),)) as pool:
        for task in tasks:
            _await_free_core(list(futures.values()), core_count)
            tick(str(task))
            with interrupts_blocked():
                futures[task] = pool.submit(fly, task)
        return {task: future.result() for task, future in futures.items()}


def _await_free_core(futures: Sequence[Future[TrackedFlight]], core_count: int) -> None:
    unfinished = [future for future in futures if not future.done()]
    if len(unfinished) >= core_count:
        wait(unfinished, return_when=FIRST_COMPLETED)
    for future in futures:
        if future.done():
            future.result()  # raises the flight's exception before more flights are started


def fly(task: Task) -> TrackedFlight:
    """Fly the task with the mock vehicle, and measure the errors.

    Raises:
        ConfigError: the shipped configuration cannot be found or used.
    """
    base = load(shipped("mock-px4.yaml"))
    wind = {"speed_m_s": task.wind, "gust_m_s": GUST_SHARE * task.wind}
    settings = {**(base.mock or {}), **_QUICK_TAKEOFF_AND_LANDING, "wind": wind}
    vehicle = MockVehicle(**settings, compiled=can_compile())
    truth = TruthRecorder(vehicle)
    with tempfile.TemporaryDirectory(prefix="companion-track-") as folder:
        trajectory_file = Path(folder, "trajectory.yaml")
        trajectory_file.write_text(bounded_yaml.dump(task.trajectory.file_content))
        summary = fly_in_memory(_task_config(base, task, trajectory_file), vehicle)
    if summary.result != "ok":
        infinite_error = PositionError(inf, inf)
        return TrackedFlight(summary.result, infinite_error, infinite_error, np.empty((0, 4)))
    tracking, (_, *trajectory) = summary.trace.tracking.rows(), summary.trace.maneuvers
    return _measure(tracking[in_maneuvers(tracking[:, 0], trajectory)], truth.rows())


def _task_config(base: Config, task: Task, trajectory_file: Path) -> Config:
    """The shipped configuration with the changes for the task."""
    changes: dict[str, dict[str, Any]] = {
        "link": {"position_rate_hz": POSITION_RATE_HZ},
        "planner": {"name": task.planner},
        "limits": {
            "max_tilt_deg": MAX_TILT_DEG,
            "max_tilt_rate_deg_s": MAX_TILT_RATE_DEG_S,
            "max_thrust": MAX_THRUST,
        },
        "guidance": {"kind": task.guidance, "lead": task.lead},
        "flight": {
            "maneuvers": ("hover", "trajectory"),
            "trajectory": trajectory_file,
            "takeoff_height_m": _HEIGHT_M,
            "arm": True,
        },
        "hover": {"duration_s": HOVER_S},
    }
    return changed(base, changes, "study track")


def _measure(tracking: Floats, truth: Floats) -> TrackedFlight:
    """Measure the errors on the trajectory.

    Args:
        tracking: rows of `FlightTrace.tracking` on the trajectory.
        truth: see `TruthRecorder.rows`.
    """
    reference, telemetry = tracking[:, 1:4], tracking[:, 4:7]
    true_position = true_positions(truth, tracking[:, 0])
    path = np.hstack([reference[:, :2], true_position[:, :2]])
    return TrackedFlight(
        "ok",
        _position_error(telemetry - reference),
        _position_error(true_position - reference),
        path,
    )


def _position_error(offsets: Floats) -> PositionError:
    distance = np.linalg.norm(offsets, axis=1)
    return PositionError(float(np.sqrt(np.mean(distance**2))), float(distance.max()))
