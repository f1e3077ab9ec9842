"""The tests of a planner package: may the planner fly, and does its name select it?

`mock_vehicle` is a pytest fixture of mavlink-companion.
"""

from collections.abc import Callable

from companion.testing import MockVehicle, check_planner, fly


def test_it_conforms() -> None:
    check_planner("thrust-axis")


def test_it_flies(mock_vehicle: Callable[..., MockVehicle]) -> None:
    vehicle = mock_vehicle("px4")
    flight = {"arm": True, "maneuvers": ["hover", "circle"]}
    config = {"planner": {"name": "thrust-axis"}, "flight": flight}
    summary = fly({**config, "thrust": {"hover_thrust": 0.49}}, vehicle)
    assert (summary.result, summary.planner) == ("ok", "thrust-axis")
    assert summary.tracking()["position_max_m"] < 1.0
