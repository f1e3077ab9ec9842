"""Table of an identified vehicle for the terminal: the values that its vehicle file holds."""

from math import degrees, isnan

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from companion.identification.delayed_model import SecondOrderFit
from companion.identification.fragment import second_order_axes
from companion.identification.response import RateResponse
from companion.identification.thrust_map import ThrustMap
from companion.identification.vehicle import IdentifiedVehicle

_NO_VALUE = "–"


def vehicle_table(vehicle: IdentifiedVehicle, gravity: float) -> RenderableType:
    """Table of the fits with one row per axis, and lines on the models; at most 80 columns wide.

    An axis that the vehicle file holds as a second-order lag shows that fit. A column without
    values is left out.

    Args:
        vehicle: the identified vehicle.
        gravity: gravity, m/s², which gives the hover thrust.
    """
    second_order_lags = second_order_axes(vehicle)
    shown_fits = {
        name: response.second_order if name in second_order_lags else None
        for name, response in vehicle.axes.items()
    }
    rows = [_cells(response, shown_fits[name]) for name, response in vehicle.axes.items()]
    names = ("lag, ms", "dead time, ms", "damping", "gain", "slew, °/s²", "misfit", "")
    columns = [
        column for column in zip(names, *rows, strict=True) if set(column[1:]) != {_NO_VALUE}
    ]
    table = Table(title="Response to body rates", title_justify="left", title_style="bold")
    table.add_column("")
    for name, *_ in columns:
        table.add_column(name, justify="right")
    for row in zip(vehicle.axes, *(cells for _, *cells in columns), strict=True):
        table.add_row(*row)
    models = [
        Text(_model_line(name, response, shown_fits[name]))
        for name, response in vehicle.axes.items()
    ]
    noise = Text("± is the standard error by the noise of this flight.")
    return Group(table, noise, *models, Text(_thrust_line(vehicle.thrust, gravity)))


def _cells(response: RateResponse, second_order: SecondOrderFit | None) -> tuple[str, ...]:
    """Table cells of one axis, from its second-order fit, or from its first-order fit if None."""
    verdict = "good" if response.is_good() else "bad"
    if isnan(response.lag):
        return *(_NO_VALUE,) * 6, verdict
    shown_fit = second_order or response
    fit, slew = shown_fit.fit, shown_fit.slew
    return (
        f"{1e3 * shown_fit.lag:.1f} ± {1e3 * fit.lag_error:.1f}",
        f"{1e3 * shown_fit.dead_time:.1f} ± {1e3 * fit.dead_time_error:.1f}",
        _NO_VALUE if second_order is None else f"{second_order.damping:.2f}",
        f"{response.gain:.2f}",
        _NO_VALUE if slew is None else f"{degrees(slew):.0f}",
        f"{fit.misfit:.0%}",
        verdict,
    )


def _model_line(name: str, response: RateResponse, second_order: SecondOrderFit | None) -> str:
    """A line that says which model the row of an axis shows, and why."""
    explained_percent, better_fit = f"{response.fit.explained:.1%}", response.second_order
    explains = f"explains {explained_percent} of the variance"
    if second_order is not None:
        explained = f"explains {second_order.fit.explained:.1%} of the variance"
        return f"{name}: second order, which {explained}; first order explains {explained_percent}"
    if better_fit is None:
        return f"{name}: a lag of first order {explains}; second order is not clearly better"
    return f"{name}: written as first order, which {explains}; a better fit: {better_fit.described}"


def _thrust_line(thrust: ThrustMap | None, gravity: float) -> str:
    if thrust is None:
        return "thrust: not measured, or never changed"
    flaw = thrust.flaw(gravity)
    if flaw is not None:
        return f"thrust: the fit is bad: {flaw}"
    return f"thrust: {thrust.described()}; hovers at {thrust.normalised(gravity):.3f}"
