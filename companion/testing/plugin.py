"""The pytest plug-in of this package: a fixture for tests that fly."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from companion.testing.vehicle import MockVehicle


@pytest.fixture
def mock_vehicle() -> "Callable[..., MockVehicle]":
    """Make mock vehicles: `mock_vehicle("px4", wind={"speed_m_s": 4.0})`; see `MockVehicle`."""

    def make(*arguments: Any, **settings: Any) -> "MockVehicle":
        from companion.testing import MockVehicle  # noqa: PLC0415  only tests that fly pay for it

        return MockVehicle(*arguments, **settings)

    return make
