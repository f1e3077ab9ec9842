"""`companion identify`: flies doublets or reads a flight, and writes the vehicle's response."""

import argparse
import json
import os
import shlex
from contextlib import suppress
from math import isfinite
from pathlib import Path
from typing import Any

from companion.cli import flying
from companion.cli.exit_codes import EXIT_FAILURE, EXIT_OK
from companion.cli.output_file import require_writable
from companion.cli.terminal import FlightConsole
from companion.config.files import load
from companion.config.vehicle import AxisKeys
from companion.files.write_whole import write_whole
from companion.files.yaml_file import ConfigError
from companion.guidance.reference import GRAVITY
from companion.identification import (
    BadFitError,
    IdentifiedVehicle,
    RateResponse,
    identify_vehicle,
    kept_axes,
    vehicle_fragment,
    vehicle_table,
)
from companion.mavlink.errors import LogError
from companion.recording.folder import flight_folder
from companion.recording.measurements.summary import Summary
from companion.recording.tlog import TLOG_FILE
from companion.vehicle.flight_log import read_flight_log

SHIPPED_CONFIG = Path()
"""Value of `--bundled` without a file: the shipped configuration."""
_MANEUVER = "identify"
_PLANNER = "first-order"
"""Planner for the flight; this one needs no knowledge of the vehicle's response."""
_LONGEST_NAME = 200
_FRAGMENT, _CONFIG = "vehicle.yaml", "config.yaml"


def identify(options: argparse.Namespace) -> int:
    """Fly and fit, or fit a recorded flight; write the fit if it is usable."""
    console = FlightConsole(stderr=options.json, highlight=False)
    if options.log is not None:
        log = _log_file(options.log)
        out = options.out or log.with_name(_FRAGMENT)
        require_writable(out, "--out", force=options.force)
        return _fit(log, out, options, console)
    if options.out is not None:
        require_writable(options.out, "--out", force=options.force)
    summary = _fly_doublets(options, console)
    if summary.result != "ok":
        _print_json(options, {"result": summary.result, "log": summary.as_dict()["log"]})
        return EXIT_FAILURE
    if summary.log is None:
        raise LogError("the record of the flight was removed or renamed, so nothing can be fitted")
    log = summary.log / TLOG_FILE
    out = options.out or log.with_name(_FRAGMENT)
    try:
        return _fit(log, out, options, console)
    except KeyboardInterrupt:
        reason = (
            f"interrupted while fitting; the flight is kept in {summary.log}; "
            f"fit it with {_fit_command(summary.log)}"
        )
        with suppress(OSError):
            console.print(reason, soft_wrap=True)
        _print_json(options, {"result": reason, "log": str(log)})
        return EXIT_FAILURE


def _log_file(given_path: Path) -> Path:
    """The log that `--log` names: a file, or the log in the folder of a flight."""
    log = given_path / TLOG_FILE if given_path.is_dir() else given_path
    if log.is_file() and log.suffix != ".mcap":
        return log
    if given_path.is_dir():
        fault, suggestion = f"holds no {TLOG_FILE}", _suggestion(given_path)
    elif not given_path.exists():
        fault, suggestion = "does not exist", _suggestion(given_path.parent)
    else:
        fault, suggestion = "is no MAVLink log", _suggestion(given_path.parent)
    raise LogError(
        f"{given_path} {fault}: --log takes the folder of a flight, or a MAVLink log such as the "
        f"flight.tlog in it{suggestion}"
    )


def _suggestion(folder: Path) -> str:
    """End of an error message that suggests the log in `folder`, else the newest flight there."""
    if (folder / TLOG_FILE).is_file():
        return f"; write --log {shlex.quote(str(folder / TLOG_FILE))}"
    flights = sorted(folder.glob(f"*/{TLOG_FILE}"), key=lambda log: log.stat().st_mtime)
    if flights:
        return f"; write --log {shlex.quote(str(flights[-1].parent))}"
    other_logs = sorted(folder.glob("*.tlog"))
    return f"; write --log {shlex.quote(str(other_logs[0]))}" if other_logs else ""


def _fly_doublets(options: argparse.Namespace, console: FlightConsole) -> Summary:
    options.maneuvers = (_MANEUVER,)
    if options.bundled is not None:
        path = None if options.bundled == SHIPPED_CONFIG else options.bundled
        return flying.fly_bundled(path, options, console, _PLANNER)
    config = flying.with_options(load(options.config), options, _PLANNER)
    return flying.fly(config, flight_folder(config.recording.directory), console)


def _fit(log: Path, out: Path, options: argparse.Namespace, console: FlightConsole) -> int:
    """Fit the data of a log, show the fit, write it to `out` if usable; return the exit code."""
    with suppress(OSError):
        console.print("fitting…")
    log_data = read_flight_log(log)
    if log_data.damage is not None:
        with suppress(OSError):
            console.print(log_data.damage, style="bold yellow", soft_wrap=True)
    vehicle = identify_vehicle(log_data.setpoints, log_data.rates, log_data.specific_thrust)
    configured_axes = _configured_axes(log)
    try:
        text = vehicle_fragment(
            vehicle, GRAVITY, configured_axes, _flight_name(log), autopilot=log_data.autopilot
        )
    except BadFitError as error:
        with suppress(OSError):
            console.print(vehicle_table(vehicle, GRAVITY))
            console.print("Not written, because the fit is bad:", style="bold red")
            for axis, flaw in vehicle.flaws().items():
                console.print(f"  {axis}: {flaw}", soft_wrap=True)
        _print_json(options, {"result": str(error), "log": str(log), **_figures(vehicle)})
        return EXIT_FAILURE
    _write_fit(out, text, flown_folder=None if options.log is not None else log.parent)
    kept_values = {
        axis: f"kept from the configuration ({keys.described()}), because the fit is bad: "
        f"{vehicle.axes[axis].flaw()}"
        for axis, keys in kept_axes(vehicle, configured_axes).items()
    }
    with suppress(OSError):
        console.print(vehicle_table(vehicle, GRAVITY))
        for axis, note in kept_values.items():
            console.print(f"{axis}: {note}", style="bold yellow", soft_wrap=True)
        console.print(_how_to_include(out, options.config), soft_wrap=True)
    result = {"result": "ok", "log": str(log), "file": str(out), "kept": kept_values}
    _print_json(options, {**result, **_figures(vehicle)})
    return EXIT_OK


def _configured_axes(log: Path) -> dict[str, AxisKeys]:
    """The response of each axis according to the configuration beside the log; may be empty."""
    try:
        return load(log.with_name(_CONFIG)).vehicle.axes
    except ConfigError:  # another program's log, or another version's configuration
        return {}


def _flight_name(log: Path) -> str:
    """Name of a flight's folder or of another program's log, with `?` for bytes not in UTF-8."""
    path = log.resolve()
    name = path.parent.name if path.name == TLOG_FILE else path.name
    return name.encode("utf-8", "replace").decode("utf-8")[:_LONGEST_NAME]


def _write_fit(out: Path, text: str, flown_folder: Path | None) -> None:
    """Write a file completely or not at all, because a flight may read it.

    `flown_folder` is the folder of the flight that was just flown, if one was.

    Raises:
        OSError: the file cannot be written; the error is a complete sentence.
    """
    try:
        write_whole(out, text)
    except OSError as error:
        reason = f"{out}: cannot write the identified response: {error.strerror}"
        if flown_folder is not None:
            reason += f"; the flight is recorded: run `{_fit_command(flown_folder)} --out FILE`"
        raise OSError(reason) from error


def _fit_command(folder: Path) -> str:
    """The command that fits the flight recorded in a folder."""
    return f"companion identify --log {shlex.quote(str(folder))}"


def _how_to_include(out: Path, config: Path | None) -> str:
    include_path = out.resolve()
    if config is not None:
        include_path = Path(os.path.relpath(include_path, config.resolve().parent))
    return (
        f"Written to {out}. Remove `vehicle` and `thrust.hover_thrust` from your configuration\n"
        f"(its keys override those of an included file), and add this line to it:\n"
        f"  include: {include_path}"
    )


def _figures(vehicle: IdentifiedVehicle) -> dict[str, Any]:
    """The figures of each axis for `--json`; null for a figure that the fit does not have."""
    return {
        name: {
            "lag_ms": _in_ms(response.lag),
            "dead_time_ms": _in_ms(response.dead_time),
            "slew_rad_s2": response.slew,
            "gain": _rounded(response.gain, 3),
            "explained": round(response.fit.explained, 4),
            "misfit": round(response.fit.misfit, 4),
            "lag_error_ms": _in_ms(response.fit.lag_error),
            "dead_time_error_ms": _in_ms(response.fit.dead_time_error),
            "second_order": _second_order(response),
        }
        for name, response in vehicle.axes.items()
    }


def _second_order(response: RateResponse) -> dict[str, float] | None:
    fit = response.second_order
    if fit is None:
        return None
    return {
        "frequency_rad_s": round(fit.frequency, 2),
        "damping": round(fit.damping, 3),
        "dead_time_ms": round(1e3 * fit.dead_time, 1),
        "explained": round(fit.fit.explained, 4),
    }


def _in_ms(seconds: float) -> float | None:
    return _rounded(1e3 * seconds, 1)


def _rounded(value: float, digits: int) -> float | None:
    return round(value, digits) if isfinite(value) else None


def _print_json(options: argparse.Namespace, result: dict[str, Any]) -> None:
    if options.json:
        print(json.dumps(result, allow_nan=False))
