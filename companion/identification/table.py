"""What a person reads of an identified vehicle."""

from math import degrees, isnan

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from companion.identification.response import RateResponse
from companion.identification.thrust_map import ThrustMap
from companion.identification.vehicle import IdentifiedVehicle


def vehicle_table(vehicle: IdentifiedVehicle, gravity: float) -> RenderableType:
    """A row an axis, what is nearer to it, a line of the thrust; at most 80 columns wide.

    Args:
        vehicle: as identified.
        gravity: m/s², at which it hovers.
    """
    table = Table(title="Response to body rates", title_justify="left", title_style="bold")
    table.add_column("")
    for column in ("lag, ms", "dead time, ms", "gain", "slew, °/s²", "misfit", ""):
        table.add_column(column, justify="right")
    for name, response in vehicle.axes.items():
        table.add_row(name, *_cells(response))
    nearer = [
        Text(f"{name}: nearer is a {response.second_order.described}")
        for name, response in vehicle.axes.items()
        if response.second_order is not None
    ]
    return Group(table, *nearer, Text(_thrust(vehicle.thrust, gravity)))


def _cells(response: RateResponse) -> tuple[str, ...]:
    verdict = "good" if response.is_good() else "bad"
    if isnan(response.lag):
        return "–", "–", "–", "–", "–", verdict
    fit = response.fit
    return (
        f"{1e3 * response.lag:.1f} ± {1e3 * fit.lag_error:.1f}",
        f"{1e3 * response.dead_time:.1f} ± {1e3 * fit.dead_time_error:.1f}",
        f"{response.gain:.2f}",
        "–" if response.slew is None else f"{degrees(response.slew):.0f}",
        f"{fit.misfit:.0%}",
        verdict,
    )


def _thrust(thrust: ThrustMap | None, gravity: float) -> str:
    if thrust is None:
        return "thrust: not measured, or never changed"
    if not thrust.is_good(gravity):
        return f"thrust: a map that explains {thrust.explained:.0%} of it is too poor to use"
    return f"thrust: {thrust.described()}; hovers at {thrust.normalised(gravity):.3f}"
