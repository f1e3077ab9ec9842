"""One flight: flown, and measured from what it recorded and from the truth beside it."""

import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from companion.mavlink.tlog_file import messages
from companion.recording.flight_record import read_flight
from companion.recording.measurements.recorded_summary import trace_of
from tests.real.flights import MOVING, PARTS, configuration, named, shipped
from tests.real.incidents import INCIDENTS, ten
from tests.real.measures import resting, straightness, tracking_errors
from tests.real.stamps import estimated, stamp_offset
from tests.real.truth import Floats, NoTruthError
from tests.real.vehicle import merged

_LONGEST_S = 900.0
"""Of our time; in lockstep a busy computer takes longer for a flight."""


class Flying:
    """Flies on one vehicle what it is told to.

    Args:
        vehicle: a `Vehicle` or a `MockVehicle`.
        changes: of the configuration, in all flights.
        base: configurations above the one that ships.
        identified: the file for flights `@identified` before the first `identify`.
    """

    def __init__(
        self, vehicle, changes: dict, base: list[Path], identified: Path | None = None
    ) -> None:
        self._vehicle = vehicle
        self._changes = changes
        self._base = [shipped(vehicle.autopilot), *base]
        self._identified = identified

    def __call__(self, flight: str, folder: Path) -> Iterator[dict]:
        """Fly it; a row for it, or for each of a series."""
        if flight == "ten":
            for row in ten(self._vehicle, folder):
                yield {"flight": "ten", "planner": "", **row}
            return
        folder.mkdir(parents=True)
        try:
            if flight == "identify":
                row = self._identify(folder)
            elif flight in INCIDENTS:
                row = INCIDENTS[flight](self._vehicle, folder)
                self._vehicle.bring_down()
            else:
                row = self._flown(flight, folder)
        except (AssertionError, NoTruthError, OSError) as error:
            row = {"error": str(error)}
            self._vehicle.bring_down()
        yield {"flight": flight, "planner": "", "load": self._vehicle.load(), **row}

    def _identify(self, folder: Path) -> dict:
        config = merged(configuration("hover", self._base, folder, self._changes), _ALONE)
        flight = self._vehicle.launch(config, command="identify", folder=folder / "flight")
        result = flight.finish(_LONGEST_S)
        self._vehicle.bring_down()
        if result.get("result") != "ok":
            return {**result, "error": result.get("result") or flight.error()}
        self._identified = Path(result["file"])
        return result

    def _flown(self, name: str, folder: Path) -> dict:
        asked = named(name)
        base = list(self._base)
        if asked.variant == "identified":
            if self._identified is None:
                return {"error": "fly identify before it, on the same vehicle"}
            base.append(self._identified)
        config = configuration(name, base, folder, self._changes)
        self._vehicle.blow(asked.variant == "wind")
        arrival = time.monotonic()
        flight = self._vehicle.launch(config, folder=folder / "flight")
        self._vehicle.face_north(flight)
        result = flight.finish(_LONGEST_S)
        self._vehicle.bring_down()
        if "log" not in result or result["log"] is None:
            return {"error": result.get("result") or flight.error()}
        out = {
            "planner": result["planner"],
            "result": result["result"],
            "log": result["log"],
            "rate_hz": result["rate_hz"],
            "missed_deadlines": result["missed_deadlines"],
            "dead_time_s": result["dead_time_s"],
            "nmpc": result["nmpc"],
        }
        if result["result"] != "ok":
            out["error"] = result["result"]
        try:
            return out | self._measured(name, result, arrival)
        except (NoTruthError, OSError) as error:
            return {"error": f"not measured: {error}", **out}

    def _measured(self, name: str, result: dict, arrival: float) -> dict:
        """All figures that the flight's folder and the truth give."""
        log = Path(result["log"])
        trace = trace_of(read_flight(log))
        tracking = trace.tracking.rows().copy()
        assert len(tracking) > 2, "hardly anything was flown under control"
        offset = stamp_offset(trace.rates.rows(), log / "flight.tlog")
        tracking[:, 0] += offset
        truth = self._vehicle.truth(arrival, float(tracking[0, 0]) - 1.0)
        if truth is not None:
            np.savez_compressed(log / "truth.npz", **truth._asdict())
        out: dict = {"reported": result["tracking"]}
        if len(trace.response):
            response = trace.response.rows().copy()
            response[:, 0] += offset
            told = estimated(response[:, 0], log / "flight.tlog")
            found = straightness(response, told, truth, result["gain_per_s"], resting(response))
            if found is not None:
                reported = result["response"]
                out["cross_axis"] = {"reported": reported["cross_axis_max"], **found}
                out["time_constant_s"] = reported["time_constant_s"]
        errors = tracking_errors(tracking, positions(log / "flight.tlog"), truth)
        moving = [part for part in named(name).parts if PARTS[part].maneuvers in MOVING]
        out["tracking"] = dict(zip(moving, errors["moving"], strict=False))
        if named(name).parts == ["hover"] and errors["hover"]:
            out["tracking"]["hover"] = max(errors["hover"], key=lambda part: part["seconds"])
        return out


_ALONE = {"flight": {"maneuvers": ["identify"]}}


def positions(log: Path) -> Floats:
    """(n, 4), rising: vehicle time s, north, east, down m, of LOCAL_POSITION_NED."""
    rows = np.array(
        [(m.time_boot_ms / 1e3, m.x, m.y, m.z) for _, m in messages(log, {"LOCAL_POSITION_NED"})]
    )
    return rows[np.unique(rows[:, 0], return_index=True)[1]]
