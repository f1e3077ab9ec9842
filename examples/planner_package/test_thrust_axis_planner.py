"""The tests that such a package has: may its planner fly, and does it fly by its name?

`mock_vehicle` is a fixture that mavlink-companion brings.
"""

from collections.abc import Callable

from companion.testing import MockVehicle, check_planner, fly


def test_it_conforms() -> None:
    check_planner("thrust-axis")


def test_it_flies(mock_vehicle: Callable[..., MockVehicle]) -> None:
    vehicle = mock_vehicle("px4")
    flight = {"arm": True, "maneuvers": ["hover", "circle"]}
    told = {"planner": {"name": "thrust-axis"}, "flight": flight}
    summary = fly({**told, "thrust": {"hover_thrust": 0.49}}, vehicle)
    assert (summary.result, summary.planner) == ("ok", "thrust-axis")
    assert summary.tracking()["position_max_m"] < 1.0
