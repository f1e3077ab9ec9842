"""Two flights that measure the vehicle before the search; their values make a start candidate."""

import tempfile
from dataclasses import replace
from pathlib import Path

from companion.attitude.planner import FIRST_ORDER
from companion.campaign.campaign import Campaign
from companion.campaign.case import Case
from companion.campaign.flight import fly_in
from companion.campaign.keys import replace_unchecked
from companion.config import Config
from companion.config.files import changed, load
from companion.files.yaml_file import ConfigError
from companion.guidance.reference import GRAVITY
from companion.identification import BadFitError, identify_vehicle, vehicle_fragment
from companion.mavlink.errors import LogError
from companion.recording.learned_file import newest_learned
from companion.recording.tlog import TLOG_FILE
from companion.vehicle.flight_log import read_flight_log

_DAMPING_KEY = "vehicle.damping"


def learned_config(campaign: Campaign) -> Config:
    """The campaign's configuration with values measured in two flights of the first case's vehicle.

    A flight of `companion identify` measures lag and dead time of the rate loop. The flight of the
    case itself measures the drag. A second-order rate loop is identified only if the search may set
    `vehicle.damping`, because lag and dead time have another meaning in that model.
    Values that were not measured stay unchanged.

    Raises:
        ConfigError: the first case cannot be flown.
    """
    tune, case, config = campaign.file.tune, next(campaign.cases()), campaign.base
    second_order = tune is not None and _DAMPING_KEY in tune.search
    return _with_drag(_with_rate_response(config, case, second_order=second_order), case)


def _with_rate_response(config: Config, case: Case, *, second_order: bool) -> Config:
    """The configuration with the response of the rate loop measured by `companion identify`.

    The configuration is unchanged if the response cannot be identified.
    """
    doublets = replace_unchecked(
        case.config,
        planner={"name": FIRST_ORDER},
        flight={"maneuvers": ("identify",), "trajectory": None},
    )
    with tempfile.TemporaryDirectory(prefix="companion-identify-") as parent_folder:
        folder, fragment = Path(parent_folder) / "flight", Path(parent_folder) / "vehicle.yaml"
        fly_in(Path(parent_folder), replace(case, config=doublets, fault=None), folder)
        try:
            log_data = read_flight_log(folder / TLOG_FILE)
            vehicle = identify_vehicle(log_data.setpoints, log_data.rates, log_data.specific_thrust)
            axes = config.vehicle.axes
            fragment_text = vehicle_fragment(
                vehicle, GRAVITY, axes, allow_second_order=second_order
            )
            fragment.write_text(fragment_text, encoding="utf-8")
            identified_keys = load(fragment).model_dump(exclude_unset=True, include={"vehicle"})
            return changed(config, identified_keys, "the identified vehicle")
        except (LogError, BadFitError, ConfigError):
            return config


def _with_drag(config: Config, case: Case) -> Config:
    """The configuration with the drag measured in a flight of the case, if drag was measured."""
    with tempfile.TemporaryDirectory(prefix="companion-drag-") as parent_folder:
        # A recorded flight writes its learned file beside its folder.
        fly_in(Path(parent_folder), replace(case, fault=None), Path(parent_folder) / "flight")
        learned_file = newest_learned(Path(parent_folder))
    if learned_file is None:
        return config
    return changed(config, learned_file.as_keys(), "the drag that a flight learned")
