"""Whole flights for the tests, in this process on one virtual clock (`companion.testing`).

Flights that need sockets, another process or the wall clock are in `sockets`.
"""

from contextlib import contextmanager
from pathlib import Path

from companion import testing
from companion.batch import can_compile
from companion.config import Config
from companion.files import bounded_yaml
from companion.files.yaml_file import parse

CONFIGS = Path(__file__).parents[2] / "configs"

WIRE_S = 0.0005
"""A datagram needs this long over UDP on a busy computer, s."""

LOOP_HZ = 100
"""Rate of the autopilot's loop and of attitude, Hz, in flights whose point is not the rate."""

FULL_RATE = {
    "px4": {"inner_loop_hz": 250, "lockstep": {"period_ms": 4}},
    "ardupilot": {"parameters": {"SCHED_LOOP_RATE": 400.0}, "lockstep": {"period_ms": 4}},
}
"""The loop of a vehicle as it is by default: for flights that measure what is flown."""

QUICK_MOCK = {
    "gcs_port": 0,
    "prearm_delay_s": 0.2,
    "inner_loop_hz": LOOP_HZ,
    "lockstep": {"period_ms": 1000 // LOOP_HZ},
}
QUICK_PARAMETERS = {
    "px4": {
        "MPC_TKO_RAMP_T": 0.3,
        "COM_SPOOLUP_TIME": 0.1,
        "MPC_TKO_SPEED": 3.0,
        "MPC_LAND_SPEED": 3.0,
        "MPC_LAND_CRWL": 1.5,
        "MPC_LAND_ALT1": 2.0,
        "MPC_LAND_ALT2": 1.0,
        "MPC_Z_V_AUTO_DN": 3.0,
        "COM_DISARM_LAND": 0.2,
    },
    "ardupilot": {
        "GUID_OPTIONS": 8,
        "ATC_ANGLE_BOOST": 0,
        "GUID_TIMEOUT": 1.0,
        "LAND_SPEED": 150.0,
        "WPNAV_SPEED_DN": 300.0,
        "WPNAV_ACCEL_Z": 300.0,
        "SCHED_LOOP_RATE": float(LOOP_HZ),
    },
}
QUICK_FLIGHT = {
    "flight": {"arm": True, "takeoff_height_m": 2.0, "maneuvers": ["hover"]},
    "hover": {"duration_s": 3.0},
    "link": {"attitude_rate_hz": float(LOOP_HZ)},
    "guidance": {"drag_per_s": 1.0},
    "thrust": {"hover_thrust": 0.49},
}
OTHER_VEHICLES = {
    "ardupilot": {
        "guidance": {"drag_per_s": 0.33, "quadratic_drag_per_m": 0.022},
        "thrust": {"hover_thrust": 0.364},
    },
}


def merged(base, changes):
    out = dict(base)
    for key, value in changes.items():
        out[key] = merged(out.get(key, {}), value) if isinstance(value, dict) else value
    return out


def quick_vehicle(autopilot, settings, *, full_rate=False):
    """The section `mock` of a vehicle that boots, climbs and lands quickly."""
    quick = {**QUICK_MOCK, "autopilot": autopilot, "parameters": QUICK_PARAMETERS[autopilot]}
    return merged(merged(quick, FULL_RATE[autopilot] if full_rate else {}), settings)


def attitude_rate_hz(mock):
    """The rate of attitude to ask this vehicle for: at most 250 Hz, at most its loop's."""
    settings = mock.settings
    loop_hz = {
        "px4": settings.inner_loop_hz,
        "ardupilot": settings.parameters.get("SCHED_LOOP_RATE", 400.0),
    }
    return min(250.0, float(loop_hz[mock.autopilot]))


class QuickVehicle(testing.MockVehicle):
    """A mock vehicle that boots, climbs and lands quickly; else as its file and settings say.

    Without lockstep, samples are answered as they come, as over UDP.
    """

    def __init__(self, autopilot=None, *, config=None, full_rate=False, lockstep=True, **others):
        told = {} if config is None else bounded_yaml.parse(config.read_text("utf-8"))["mock"]
        autopilot = autopilot or told.get("autopilot", "px4")
        stepping = {"enabled": lockstep} if isinstance(lockstep, bool) else lockstep
        kept = {"delay_s": others.pop("delay_s", 0.0)}
        kept["compiled"] = others.pop("compiled", can_compile())
        known = merged(told, {**others, "autopilot": autopilot, "lockstep": stepping})
        known = quick_vehicle(autopilot, known, full_rate=full_rate)
        super().__init__(**kept, **known)


def quick_flight(autopilot, changes, **link):
    """The configuration of a short hover of such a vehicle, with changes."""
    flight = merged(QUICK_FLIGHT, OTHER_VEHICLES.get(autopilot, {}))
    text = bounded_yaml.dump(merged(merged(flight, {"link": link}), changes))
    return parse(text, "test", Config)


@contextmanager
def mock_vehicle(folder=None, *, in_lockstep=False, autopilot="px4", delay_s=WIRE_S, **settings):
    """A quick vehicle in memory; `folder` is there because those of `sockets` need it.

    In lockstep fly those flights whose test counts on the moment of a telemetry message.
    """
    stepping = {"enabled": in_lockstep, **settings.pop("lockstep", {})}
    yield QuickVehicle(autopilot, delay_s=delay_s, lockstep=stepping, **settings)


def session_for(mock, folder: Path | None = None, observer=None, ask_landing=None, **changes):
    config = quick_flight(mock.autopilot, changes, attitude_rate_hz=attitude_rate_hz(mock))
    return testing.session(config, mock, folder, observer, ask_landing)


def fly(mock, folder: Path | None = None, observer=None, ask_landing=None, **changes):
    """One flight; returns its summary.

    Without a folder nothing is recorded, which is a fifth of a flight's cost. Recorded are those
    flights whose files a test reads, each fault of `test_faults` among them.
    """
    return testing.run(mock, session_for(mock, folder, observer, ask_landing, **changes).fly())


run = testing.run
