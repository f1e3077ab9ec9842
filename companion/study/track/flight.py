"""One flight of the study: the bundled vehicle follows one course, in lockstep over a socket."""

import tempfile
from math import inf
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from companion import demo
from companion.config import Config
from companion.config.files import changed, load
from companion.files import bounded_yaml
from companion.flight.session import Session
from companion.mavlink import lockstep
from companion.study.step import Floats
from companion.study.track.task import Task
from companion.study.track.truth import TruthWatch

POSITION_RATE_HZ = 30.0
MAX_TILT_DEG, MAX_TILT_RATE_DEG_S, MAX_THRUST = 58.0, 250.0, 0.98
"""The circle at 7 m/s takes 51° against its own drag, and wind comes on top."""
GUSTS = 1.0 / 3.0
"""Standard deviation of the gusts north and east, as a share of the mean wind."""
HOLD_S = 2.0
"""Before the course, so that taking over is no part of it."""
_HEIGHT_M = 3.0
_BRISK = {
    "prearm_delay_s": 0.2,
    "parameters": {
        "COM_DISARM_LAND": 0.2,
        "COM_SPOOLUP_TIME": 0.1,
        "MPC_LAND_SPEED": 2.0,
        "MPC_TKO_RAMP_T": 0.3,
        "MPC_TKO_SPEED": 3.0,
    },
}
"""Of the vehicle, for what comes before and after the course."""


class Off(NamedTuple):
    """Distance from where the vehicle should be, over a course.

    Attributes:
        rms: m.
        largest: m.
    """

    rms: float
    largest: float


class Tracked(NamedTuple):
    """What came of a flight; where it failed, the errors are infinite.

    Attributes:
        result: "ok", or why it ended.
        told: position error by telemetry, as guidance made use of it.
        true: by where the vehicle really was.
        path: (n, 4): where it should be and where it really was, each north and east, m.
    """

    result: str
    told: Off
    true: Off
    path: Floats

    @property
    def ok(self) -> bool:
        """Whether the course was flown to its end."""
        return self.result == "ok"


_NOT_FLOWN = Off(inf, inf)


def fly(task: Task) -> Tracked:
    """Start the bundled vehicle, fly the task with it, and measure.

    Raises:
        ConfigError: the configuration that ships cannot be found or used.
        VehicleStoppedError: the vehicle ended before the flight did.
    """
    with tempfile.TemporaryDirectory(prefix="companion-track-") as name:
        folder = Path(name)
        wire, watch_port = demo.udp_wire(), demo.free_port()
        shipped = load(demo.default_config())
        vehicle, course = folder / "vehicle.yaml", folder / "course.yaml"
        vehicle.write_text(bounded_yaml.dump({"mock": _vehicle(shipped, task, watch_port)}))
        course.write_text(bounded_yaml.dump(task.course.file))
        config = _configured(shipped, task, course, wire.endpoint)
        watch = TruthWatch(watch_port)
        session = Session(config, folder, watch, _never)
        with demo.bundled_vehicle(vehicle, wire, folder / "vehicle.log", lockstep=True):
            summary = lockstep.run(session.fly())
    if summary.result != "ok":
        return Tracked(summary.result, _NOT_FLOWN, _NOT_FLOWN, np.empty((0, 4)))
    return _measured(summary.trace.tracking_rows(), watch.rows())


def _vehicle(shipped: Config, task: Task, watch_port: int) -> dict[str, Any]:
    """The bundled vehicle as it ships, in the wind of the task."""
    wind = {"speed_m_s": task.wind, "gust_m_s": GUSTS * task.wind}
    return {**(shipped.mock or {}), **_BRISK, "control_port": watch_port, "wind": wind}


def _configured(shipped: Config, task: Task, course: Path, endpoint: str) -> Config:
    """The companion as it ships, but for what the task asks."""
    changes: dict[str, dict[str, Any]] = {
        "link": {
            "endpoint": endpoint,
            "lockstep": True,
            "position_rate_hz": POSITION_RATE_HZ,
        },
        "planner": {"name": task.planner},
        "limits": {
            "max_tilt_deg": MAX_TILT_DEG,
            "max_tilt_rate_deg_s": MAX_TILT_RATE_DEG_S,
            "max_thrust": MAX_THRUST,
        },
        "guidance": {"kind": task.guidance, "lead": task.lead},
        "flight": {
            "programme": ("hover", "trajectory"),
            "trajectory": course,
            "takeoff_height_m": _HEIGHT_M,
            "arm": True,
        },
        "hover": {"duration_s": HOLD_S},
    }
    return changed(shipped, changes, "study track")


async def _never() -> bool:
    return False


def _measured(tracking: Floats, truth: Floats) -> Tracked:
    """Measure over the course alone: from the end of the hold to the end of the watch.

    Args:
        tracking: rows as `FlightTrace.tracking`.
        truth: rows as `TruthWatch.rows`.
    """
    watched = truth[:, 0]
    flown = tracking[(tracking[:, 0] >= watched[0] + HOLD_S) & (tracking[:, 0] <= watched[-1])]
    should, told = flown[:, 1:4], flown[:, 4:7]
    true = np.column_stack([np.interp(flown[:, 0], watched, axis) for axis in truth[:, 1:].T])
    path = np.hstack([should[:, :2], true[:, :2]])
    return Tracked("ok", _off(told - should), _off(true - should), path)


def _off(error: Floats) -> Off:
    distance = np.linalg.norm(error, axis=1)
    return Off(float(np.sqrt(np.mean(distance**2))), float(distance.max()))
