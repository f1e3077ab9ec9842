"""Whole flights in one process on one virtual clock, for tests and campaigns.

The mock vehicle and the application are joined in memory. The time of the application's event loop
is the vehicle's: when the application has nothing left to do, the vehicle simulates its next step.
Nothing sleeps, no socket is opened, and equal inputs give equal flights to the bit.

    from companion.testing import MockVehicle, fly

    def test_my_limits_hold_in_wind():
        vehicle = MockVehicle("px4", wind={"speed_m_s": 8.0})
        summary = fly("my-vehicle.yaml", vehicle)
        assert summary.result == "ok", summary.events
        assert summary.tracking()["position_max_m"] < 1.0
        assert not vehicle.state()["crashed"]

`MockVehicle` tells the true state and what setpoints it received, takes faults, and gives the
pilot's sticks and another station's commands. `fly` takes a configuration and flies it; `run` runs
any coroutine on the vehicle's clock, with links opened by `open_wire`. A program of your own flies
inside `run` by `connect`, which gives it the same `Vehicle` as `companion.connect`.

`check_planner` and `check_guidance` tell whether a planner or guidance of your own may fly. In
pytest the fixture `mock_vehicle` makes vehicles.
"""

from companion.testing.conformance import check_guidance, check_planner
from companion.testing.flying import UnseenError, connect, environment, fly, run, session
from companion.testing.vehicle import MockVehicle, ReceivedSetpoint
from companion.testing.virtual_loop import VirtualEventLoop
from companion.testing.wire import open_wire
from sitl_mock.control_channel import Truth

__all__ = [
    "MockVehicle",
    "ReceivedSetpoint",
    "Truth",
    "UnseenError",
    "VirtualEventLoop",
    "check_guidance",
    "check_planner",
    "connect",
    "environment",
    "fly",
    "open_wire",
    "run",
    "session",
]
