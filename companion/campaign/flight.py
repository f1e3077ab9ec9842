"""One whole flight of a campaign, in this process on one virtual clock."""

import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from companion.batch import can_compile
from companion.campaign import outcomes
from companion.campaign.case import Case, Fault
from companion.campaign.keys import replace_unchecked
from companion.campaign.swept import Value
from companion.config import Config
from companion.files.yaml_file import ConfigError
from companion.flight.observer import SilentObserver
from companion.testing import MockVehicle, Truth, run, session
from companion.testing.truth import TruthRecorder

if TYPE_CHECKING:
    from distributed import Worker

DATAGRAM_DELAY_S = 0.0005
"""Delay of a datagram between program and mock vehicle, as over UDP, s."""
INTERNAL_ERROR = "internal error: "
"""Prefix of the result of a case in which the program itself failed."""
_MAX_TIME_AFTER_END_S = 10.0
"""Longest time for which a vehicle that is still armed is simulated after the program ended, s."""
_PILOT_MODES = (  # of PX4 and ArduPilot
    "POSCTL",
    "ALTCTL",
    "STABILIZED",
    "MANUAL",
    "LOITER",
    "ALT_HOLD",
    "STABILIZE",
)


def fly_case(case: Case, folder: Path | None = None) -> dict[str, Value]:
    """Fly one case; equal cases give equal rows, to the bit.

    `folder` gets the files of a fully recorded flight; None: no files are written.

    Returns:
        One row of the results: `case`, `seed`, the factors, and the outcomes. If the case raises an
        error, `result` is the error.
    """
    row: dict[str, Value] = {"case": case.index, "seed": case.seed, **case.factors}
    # Dask removes the folder of a worker even if the worker is killed.
    worker = running_worker()
    parent = None if worker is None else worker.local_directory
    with tempfile.TemporaryDirectory(prefix="companion-case-", dir=parent) as files_folder:
        try:
            return row | fly_in(Path(files_folder), case, folder)
        except ConfigError as error:  # such as a trajectory that the limits do not allow
            reason = str(error)
        except Exception as error:
            reason = f"{INTERNAL_ERROR}{type(error).__name__}: {error}"
        return row | outcomes.error_outcomes(reason.replace(f"{files_folder}/", ""))


def fly_in(files_folder: Path, case: Case, folder: Path | None) -> dict[str, Value]:
    """Fly one case; return its outcomes.

    The files that the flight reads are written into `files_folder`. `folder`: see `fly_case`.

    Raises:
        ConfigError: the configuration cannot be flown.
    """
    config = _with_files_in(files_folder, case)
    settings = {**case.mock, "lockstep": False}
    vehicle = MockVehicle(delay_s=DATAGRAM_DELAY_S, compiled=can_compile(), **settings)
    truth, injector = TruthRecorder(vehicle), _FaultInjector(vehicle, case.fault)
    flight = session(config, vehicle, folder, injector)
    time_limit_reached = False

    def end() -> None:
        nonlocal time_limit_reached
        time_limit_reached = True
        flight.leave()

    vehicle.at(case.flight_s, end)
    summary = run(vehicle, flight.fly())
    result, truth_at_end, flight_s = summary.result, vehicle.state(), vehicle.time
    vehicle.after_step.clear()
    while vehicle.state()["armed"] and vehicle.time < flight_s + _MAX_TIME_AFTER_END_S:
        vehicle.step()
    crashed, as_documented = vehicle.state()["crashed"], None
    if case.fault is not None and injector.has_begun and case.fault.ends:
        as_documented = not crashed and _ending(truth_at_end, result) in case.fault.ends
    if time_limit_reached:
        result = f"ended by limits.flight_s after {case.flight_s:g} s of vehicle time"
    failed_checks = outcomes.failed_checks(summary.as_dict())
    measured_outcomes = {
        **outcomes.tracking(summary, truth.rows()),
        **outcomes.response(summary),
        **outcomes.control_effort(vehicle.setpoints, summary, config),
        "flight_s": flight_s,
    }
    return {
        "ok": result == "ok" and not failed_checks and not crashed,
        "result": result.replace(f"{files_folder}/", ""),
        "failed_checks": failed_checks,
        "phase": summary.phase,
        "crashed": crashed,
        "as_documented": as_documented,
        **outcomes.without_nan(measured_outcomes),
        "setpoints": len(vehicle.setpoints),
        "digest": outcomes.digest(vehicle.setpoints, vehicle.state()),
    }


def running_worker() -> "Worker | None":
    """The Dask worker that runs this code; None: no worker does."""
    if "distributed" not in sys.modules:  # a worker has imported it; the import takes 0.6 s
        return None
    from distributed import get_worker  # noqa: PLC0415  an extra

    try:
        return get_worker()
    except ValueError:
        return None


class _FaultInjector(SilentObserver):
    """Injects the faults of a scenario at a set time after the beginning of a phase.

    Args:
        vehicle: the mock vehicle.
        fault: the scenario; None: no fault.

    Attributes:
        has_begun: whether there is a fault, and the phase in which it begins was reached.
    """

    def __init__(self, vehicle: MockVehicle, fault: Fault | None) -> None:
        self._vehicle, self._fault = vehicle, fault
        self.has_begun = False
        self._phases: tuple[str, ...] = () if fault is None else (fault.phase,)
        if self._phases == ("stream",):
            self._phases = "stream", "arm"  # the first one reached: not every vehicle has `stream`

    def phase(self, name: str, waits_for: str) -> None:
        """Inject the faults if they begin in the phase `name`."""
        if self._fault is None or self.has_begun or name not in self._phases:
            return
        self.has_begun = True
        begin_s = self._vehicle.time + self._fault.after_s
        for entry in self._fault.inject:
            self._vehicle.inject({**entry, "at_s": begin_s})


def _ending(state: Truth, result: str) -> str:
    """The ending of a flight, as named in `FaultScenario.ends`."""
    if "took over: mode" in result and state["mode"] in _PILOT_MODES:
        return "pilot" if state["armed"] else "ground"
    if state["armed"]:
        return "held"
    if result == "ok":
        return "ok"
    return "ground" if state["touchdown_speed"] is None else "landed"


def _with_files_in(files_folder: Path, case: Case) -> Config:
    """Write the files that the flight reads into `files_folder`; return the configuration.

    `recording.directory` is a new folder there, so no values learned in earlier flights are used.
    """
    for name, text in case.files.items():
        path = files_folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    trajectory = case.config.flight.trajectory
    return replace_unchecked(
        case.config,
        recording={"directory": files_folder / "learned"},
        flight={"trajectory": None if trajectory is None else files_folder / trajectory},
    )
