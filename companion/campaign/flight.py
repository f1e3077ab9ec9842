"""One whole flight of a campaign, in this process on one virtual clock."""

import tempfile
from pathlib import Path

from companion.batch import can_compile
from companion.campaign import outcomes
from companion.campaign.case import Case, Fault
from companion.campaign.keys import replace_unchecked
from companion.campaign.swept import Value
from companion.campaign.worker import running_worker
from companion.config import Config
from companion.files.yaml_file import ConfigError
from companion.flight.observer import SilentObserver
from companion.recording.measurements.summary import Summary
from companion.testing import MockVehicle, Truth, run, session
from companion.testing.truth import TruthRecorder

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
            return row | CaseFlight(case, Path(files_folder)).fly(folder)
        except ConfigError as error:  # such as a trajectory that the limits do not allow
            reason = str(error)
        except Exception as error:
            reason = f"{INTERNAL_ERROR}{type(error).__name__}: {error}"
        return row | outcomes.error_outcomes(reason.replace(f"{files_folder}/", ""))


class CaseFlight:
    """The flight of one case; the files that it reads are written into a new folder.

    Raises:
        ConfigError: the configuration cannot be flown.
    """

    def __init__(self, case: Case, files_folder: Path) -> None:
        for name, text in case.files.items():
            path = files_folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8")
        self._case, self._files_folder = case, files_folder
        self._config = _with_paths_in(case.config, files_folder)
        settings = {**case.mock, "lockstep": False}
        self._vehicle = MockVehicle(delay_s=DATAGRAM_DELAY_S, compiled=can_compile(), **settings)
        self._truth = TruthRecorder(self._vehicle)
        self._time_limit_reached = False

    def fly(self, folder: Path | None) -> dict[str, Value]:
        """Fly the case; return its outcomes. `folder`: see `fly_case`."""
        vehicle, case = self._vehicle, self._case
        injector = _FaultInjector(vehicle, case.fault)
        flight = session(self._config, vehicle, folder, injector)

        def end() -> None:
            self._time_limit_reached = True
            flight.leave()

        vehicle.at(case.flight_s, end)
        summary = run(vehicle, flight.fly())
        truth_at_end = vehicle.state()
        flight_s = vehicle.time
        vehicle.after_step.clear()
        while vehicle.state()["armed"] and vehicle.time < flight_s + _MAX_TIME_AFTER_END_S:
            vehicle.step()
        truth_afterwards = vehicle.state()
        return self._outcomes(
            summary, truth_at_end, truth_afterwards, flight_s, fault_has_begun=injector.has_begun
        )

    def _outcomes(
        self,
        summary: Summary,
        truth_at_end: Truth,
        truth_afterwards: Truth,
        flight_s: float,
        *,
        fault_has_begun: bool,
    ) -> dict[str, Value]:
        """The outcomes of the flight.

        `truth_at_end` is the true state when the program ended, `flight_s` s after boot.
        `truth_afterwards` is the true state when the vehicle disarmed, or `_MAX_TIME_AFTER_END_S`
        after the program's end. `fault_has_begun`: whether the phase in which the fault begins was
        reached.
        """
        figures, setpoints = summary.as_dict(), self._vehicle.setpoints
        crashed, fault = truth_afterwards["crashed"], self._case.fault
        measured_outcomes = {
            **outcomes.tracking(summary, self._truth.rows()),
            **outcomes.response(summary),
            **outcomes.control_effort(setpoints, summary, self._config),
            "flight_s": flight_s,
        }
        as_documented = None
        if fault is not None and fault_has_begun and fault.ends:
            as_documented = not crashed and _ending(truth_at_end, summary.result) in fault.ends
        result = summary.result
        if self._time_limit_reached:
            result = f"ended by limits.flight_s after {self._case.flight_s:g} s of vehicle time"
        failed_checks = outcomes.failed_checks(figures)
        is_good = result == "ok" and not failed_checks and not crashed
        return {
            "ok": is_good,
            "result": result.replace(f"{self._files_folder}/", ""),
            "failed_checks": failed_checks,
            "phase": summary.phase,
            "crashed": crashed,
            "as_documented": as_documented,
            **outcomes.without_nan(measured_outcomes),
            "setpoints": len(setpoints),
            "digest": outcomes.digest(setpoints, truth_afterwards),
        }


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


def _with_paths_in(config: Config, files_folder: Path) -> Config:
    """The configuration with its trajectory and its `recording.directory` in `files_folder`.

    `recording.directory` is a new folder there, so no values learned in earlier flights are used.
    """
    path = config.flight.trajectory
    return replace_unchecked(
        config,
        recording={"directory": files_folder / "learned"},
        flight={"trajectory": None if path is None else files_folder / path},
    )
