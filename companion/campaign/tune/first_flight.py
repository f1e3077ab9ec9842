"""What a first flight teaches of the campaign's vehicle: from there the search can start."""

import tempfile
from dataclasses import replace
from pathlib import Path

from companion.attitude.planner import FIRST_ORDER
from companion.campaign.campaign import Campaign
from companion.campaign.case import Case
from companion.campaign.flight import CaseFlight
from companion.config import Config
from companion.config.files import changed, load
from companion.files.yaml_file import ConfigError
from companion.guidance.reference import GRAVITY
from companion.identification import (
    BadFitError,
    identify_vehicle,
    second_order_keys,
    vehicle_fragment,
)
from companion.mavlink.errors import LogError
from companion.recording.learned_file import newest
from companion.vehicle.flight_log import read_flight_log

_DAMPING = "vehicle.damping"


def learned(campaign: Campaign) -> Config:
    """The campaign's configuration with what two flights of its first case's vehicle teach.

    `companion identify` is flown for lag and dead time, and the case itself for the drag. A rate
    loop of second order is used only if the search may set `vehicle.damping`: lag and dead time
    mean something else with it. What a flight could not teach stays as it was.
    """
    tune, case, config = campaign.file.tune, next(campaign.cases()), campaign.base
    damped = tune is not None and _DAMPING in tune.search
    return _with_drag(_identified(config, case, damped=damped), case)


def _identified(config: Config, case: Case, *, damped: bool) -> Config:
    """The configuration with the times of the rate loop that `companion identify` finds."""
    planner = case.config.planner.model_copy(update={"name": FIRST_ORDER})
    flight = case.config.flight.model_copy(update={"maneuvers": ("identify",), "trajectory": None})
    doublets = case.config.model_copy(update={"planner": planner, "flight": flight})
    with tempfile.TemporaryDirectory(prefix="companion-identify-") as place:
        folder, fragment = Path(place) / "flight", Path(place) / "vehicle.yaml"
        CaseFlight(replace(case, config=doublets, fault=None), Path(place)).fly(folder)
        try:
            rows = read_flight_log(folder / "flight.tlog")
            vehicle = identify_vehicle(rows.setpoints, rows.rates, rows.specific_thrust)
            fragment.write_text(vehicle_fragment(vehicle, GRAVITY, config.vehicle.axes))
            told = load(fragment).model_dump(exclude_unset=True, include={"vehicle"})
            if damped:
                told["vehicle"] |= second_order_keys(vehicle)
            return changed(config, told, "the identified vehicle")
        except (LogError, BadFitError, ConfigError):
            return config


def _with_drag(config: Config, case: Case) -> Config:
    """The configuration with the drag that a flight of the case learns."""
    with tempfile.TemporaryDirectory(prefix="companion-drag-") as place:
        # A recorded flight keeps what it learned beside its folder.
        CaseFlight(replace(case, fault=None), Path(place)).fly(Path(place) / "flight")
        known = newest(Path(place))
    if known is None:
        return config
    drag = {"drag_per_s": known.drag.linear, "quadratic_drag_per_m": known.drag.quadratic}
    return changed(config, {"guidance": drag}, "the drag that a flight learned")
