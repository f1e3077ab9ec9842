"""Whole flights in one process on one virtual clock, for tests and campaigns.

The mock vehicle and the program are joined in memory. The program's event loop runs on the
vehicle's time: when the program has nothing left to do, the vehicle simulates its next step.
Nothing sleeps, no socket is opened, and equal inputs give equal flights to the bit.

    from companion.testing import MockVehicle, fly

    def test_my_limits_hold_in_wind():
        vehicle = MockVehicle("px4", wind={"speed_m_s": 8.0})
        summary = fly("my-vehicle.yaml", vehicle)
        assert summary.result == "ok", summary.events
        assert summary.tracking()["position_max_m"] < 1.0
        assert not vehicle.state()["crashed"]

Each name below has its own page: `help(companion.testing.MockVehicle)`.

Flights
    MockVehicle         the vehicle: its true state, faults, the pilot, what it received
    fly                 flies a configuration, as `companion fly` does; returns its summary
    connect             the same `Vehicle` as `companion.connect`, inside `run`
    run                 runs a coroutine on the vehicle's clock
    session             a flight that can be interrupted, to be flown inside `run`
    serving             `companion serve` in memory, inside `run`
    Program             a client program that speaks MAVLink to `companion serve`
    ReceivedSetpoint    a setpoint that reached the autopilot: `MockVehicle.setpoints`
    Truth               the true state: `MockVehicle.state()`

Checks of your own planner and guidance
    check_planner       whether a planner may fly
    check_guidance      whether guidance may fly

Parts of the above
    VirtualEventLoop    the event loop whose time is the vehicle's
    open_wire           opens a link inside `run`: `Link(settings, opener=open_wire)`
    environment         what a flight inside `run` gets from the computer
    UnhandledError      a task or callback failed, and the error was not handled

In pytest the fixture `mock_vehicle` makes vehicles.
"""

from importlib import import_module
from typing import TYPE_CHECKING

# Without `__all__`: see `companion.attitude`. pytest imports this package in every environment that
# has it, for the fixture, so its modules are imported when a name of theirs is first used.
if TYPE_CHECKING:
    from companion.testing.client_programs import Program as Program
    from companion.testing.client_programs import serving as serving
    from companion.testing.conformance import check_guidance as check_guidance
    from companion.testing.conformance import check_planner as check_planner
    from companion.testing.flying import UnhandledError as UnhandledError
    from companion.testing.flying import connect as connect
    from companion.testing.flying import environment as environment
    from companion.testing.flying import fly as fly
    from companion.testing.flying import run as run
    from companion.testing.flying import session as session
    from companion.testing.setpoints import ReceivedSetpoint as ReceivedSetpoint
    from companion.testing.vehicle import MockVehicle as MockVehicle
    from companion.testing.virtual_loop import VirtualEventLoop as VirtualEventLoop
    from companion.testing.wire import open_wire as open_wire
    from sitl_mock.control_channel import Truth as Truth

_NAMES = {
    ".client_programs": ("Program", "serving"),
    ".conformance": ("check_guidance", "check_planner"),
    ".flying": ("UnhandledError", "connect", "environment", "fly", "run", "session"),
    ".setpoints": ("ReceivedSetpoint",),
    ".vehicle": ("MockVehicle",),
    ".virtual_loop": ("VirtualEventLoop",),
    ".wire": ("open_wire",),
    "sitl_mock.control_channel": ("Truth",),
}
_MODULE_OF = {name: module for module, names in _NAMES.items() for name in names}


def __getattr__(name: str) -> object:
    """Import one of the public names when a program first uses it."""
    if name not in _MODULE_OF:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = globals()[name] = getattr(import_module(_MODULE_OF[name], __name__), name)
    return value


def __dir__() -> list[str]:
    """The public names, imported or not."""
    return sorted({*globals(), *_MODULE_OF})
