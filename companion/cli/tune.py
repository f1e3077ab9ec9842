"""`companion tune`: propose gain, weights and bandwidth for an identified vehicle."""

import argparse
import json
import os
from collections.abc import Sequence
from dataclasses import asdict
from math import isfinite
from pathlib import Path
from typing import Any

from rich.console import Console

from companion.cli.exit_codes import EXIT_FAILURE, EXIT_OK
from companion.cli.output_file import require_writable
from companion.config import Config
from companion.config.files import changed, load
from companion.config.known_drag import drag_prior
from companion.files.write_whole import write_whole
from companion.files.yaml_file import ConfigError
from companion.recording.learned_file import newest_learned
from companion.recording.tlog import TLOG_FILE
from companion.tuning import Disturbances, Proposal, propose
from companion.tuning.flights import TRIAL_FLIGHTS, TrialResult, fly_trial, matching_autopilot
from companion.tuning.noise import measured_disturbances
from companion.tuning.writing import proposal_text, summary_lines, worse_flights_warning

_VEHICLE, _CONFIG = "vehicle.yaml", "config.yaml"
_OUTPUT_NAME = "tuned.yaml"
_VEHICLE_SECTIONS = {"vehicle", "thrust"}
"""The sections that `companion identify` writes."""


def tune(options: argparse.Namespace) -> int:
    """Propose values, fly the proposal on the mock vehicle, and write it."""
    console = Console(stderr=options.json, highlight=False, soft_wrap=True, markup=False)
    source: Path = options.vehicle
    vehicle_file = source / _VEHICLE if source.is_dir() else source
    output = options.output or vehicle_file.with_name(_OUTPUT_NAME)
    config, has_vehicle_file = _configuration(source, vehicle_file, options.config)
    require_writable(output, "--out", force=options.force)
    config = _with_learned_drag(config, source)
    log = source / TLOG_FILE
    disturbances = Disturbances()
    if source.is_dir() and log.exists():
        drag = drag_prior(config).drag.linear
        disturbances = measured_disturbances(log, drag, disturbances, console.print)
    proposal = propose(config, disturbances)
    flights = {} if options.no_flights else _fly_trials(proposal, console)
    vehicle_source: Path | dict[str, Any]
    if has_vehicle_file:
        vehicle_source = Path(os.path.relpath(vehicle_file.resolve(), output.resolve().parent))
    else:
        values = proposal.tuned.vehicle.model_dump(
            mode="json", exclude_none=True, exclude_defaults=True
        )
        vehicle_source = {"vehicle": values}
    # Printed first, so that a full disk does not lose it.
    console.print("\n".join(summary_lines(proposal, flights)))
    write_whole(output, proposal_text(proposal, vehicle_source, flights, source.name))
    load(output)
    keys = [f"{section}.{key}" for section, keys in proposal.changes.items() for key in keys]
    is_own = has_vehicle_file and not load(vehicle_file).model_fields_set <= _VEHICLE_SECTIONS
    console.print(_next_step(output, keys, vehicle_file if is_own else None))
    if options.json:
        print(json.dumps(_figures(proposal, flights, output), allow_nan=False))
    return EXIT_OK if worse_flights_warning(flights) is None else EXIT_FAILURE


def _next_step(output: Path, keys: Sequence[str], user_config: Path | None) -> str:
    """What to do with `output`; `user_config`: the user's configuration that `output` includes."""
    if user_config is not None:
        return (
            f"Written to {output}, which includes {user_config}. Fly it with --config {output}; do "
            f"not include it in {user_config}."
        )
    return (
        f"Written to {output}. Let your configuration include it, and remove {', '.join(keys)} "
        "from your own file: keys there override those of an included file."
    )


def _configuration(source: Path, vehicle_file: Path, base: Path | None) -> tuple[Config, bool]:
    """The configuration to tune, and whether the vehicle's response comes from a vehicle file."""
    recorded_config = source / _CONFIG
    if base is None and source.is_dir() and recorded_config.exists():
        base = recorded_config
    if not vehicle_file.exists():
        if base is None or source.is_file() or not source.exists():
            raise ConfigError(
                f"{vehicle_file} does not exist; name the file or the flight folder that "
                "`companion identify` wrote"
            )
        return _with_hover(load(base)), False
    identified_config = load(vehicle_file)
    if base is None:  # a file with a mock vehicle cannot be included
        return _with_hover(identified_config), identified_config.mock is None
    identified_keys = identified_config.model_dump(exclude_unset=True, include=_VEHICLE_SECTIONS)
    return _with_hover(changed(load(base), identified_keys, str(vehicle_file))), True


def _with_learned_drag(config: Config, source: Path) -> Config:
    """The configuration with the drag learned by the flights in the same folder as `source`."""
    learned_file = newest_learned(source.resolve().parent) if source.is_dir() else None
    if config.guidance.drag is not None or learned_file is None:
        return config
    return changed(config, learned_file.as_keys(), str(learned_file.path))


def _with_hover(config: Config) -> Config:
    """The configuration with planner `auto` and maneuver `hover` instead of those of `identify`."""
    return changed(
        config, {"planner": {"name": "auto"}, "flight": {"maneuvers": ("hover",)}}, "tune"
    )


def _fly_trials(proposal: Proposal, console: Console) -> dict[str, tuple[TrialResult, TrialResult]]:
    """Fly each trial flight with the previous configuration and with the proposed one."""
    autopilot = matching_autopilot(proposal.tuned)
    flights = {}
    for trial in TRIAL_FLIGHTS:
        console.print(f"flying the {trial.name} on the {autopilot} mock vehicle…")
        flights[trial.name] = (
            fly_trial(proposal.untuned, trial, autopilot),
            fly_trial(proposal.tuned, trial, autopilot),
        )
    return flights


def _figures(
    proposal: Proposal, flights: dict[str, tuple[TrialResult, TrialResult]], output: Path
) -> dict[str, Any]:
    """The figures for `--json`; a value that a failed flight did not measure is null."""
    expected_figures = {}
    for name, tuning in (("before", proposal.before), ("after", proposal.after)):
        margins = tuning.margins
        expected_figures[name] = {
            "gain_margin_db": round(margins.gain_db, 2),
            "phase_margin_deg": round(margins.phase_deg, 1),
            "delay_margin_ms": round(1e3 * margins.delay, 1),
            "error_by_gusts_m": round(tuning.errors.gusts, 4),
            "error_on_a_path_m": round(tuning.errors.path, 4),
            "error_by_noise_m": round(tuning.errors.noise, 4),
            "settling_s": round(tuning.settling_time, 2),
        }
    flown_figures = {
        name: {
            when: {key: _rounded(value) for key, value in asdict(flight).items()}
            for when, flight in zip(("before", "after"), trial_results, strict=True)
        }
        for name, trial_results in flights.items()
    }
    return {
        "file": str(output),
        "proposed": proposal.changes,
        "expected": expected_figures,
        "flights": flown_figures,
    }


def _rounded(value: Any) -> Any:
    if isinstance(value, float):
        return round(value, 4) if isfinite(value) else None
    return value
