"""The pilot's transmitter falls silent; the autopilot's failsafe then returns."""

import threading
import time
from contextlib import contextmanager

from tests.real.outcome import figures
from tests.real.vehicle import Vehicle

_STICK_PERIOD_S = 0.04
_CONTROLLED_S = 0.3
"""The program has had control for only so long when the transmitter is lost, s."""


def lost_in_climb(vehicle: Vehicle) -> dict:
    """PX4 holds for COM_FAIL_ACT_T before it returns; ArduPilot returns at once."""
    with _transmitter(vehicle) as silence:
        flight, station = vehicle.fly(), vehicle.station
        climbed = lambda: station.seen and station.seen[-1].up - station.seen[0].up > 1.0  # noqa: E731
        station.until(lambda: station.armed and climbed(), 120.0, "climb")
        return _outcome(vehicle, flight, silence)


def lost_before_control(vehicle: Vehicle) -> dict:
    """Lost as soon as PX4 holds at the end of the climb, before the program takes control."""
    with _transmitter(vehicle) as silence:
        flight, station = vehicle.fly(), vehicle.station
        station.until(lambda: station.armed and station.mode == "TAKEOFF", 120.0, "take-off")
        station.until(lambda: station.mode == "LOITER", 60.0, "the end of the climb")
        return _outcome(vehicle, flight, silence)


def lost_in_control(vehicle: Vehicle) -> dict:
    """The same just after the program took control."""
    with _transmitter(vehicle) as silence:
        return _outcome(vehicle, vehicle.hovering(_CONTROLLED_S), silence)


def _outcome(vehicle, flight, silence) -> dict:
    event = silence()
    flight.finish()
    texts = [(round(at - event, 2), text) for at, text in vehicle.station.texts if at > event]
    return figures(vehicle, flight, event, 20.0, texts=texts[:6])


@contextmanager
def _transmitter(vehicle: Vehicle):
    """A transmitter that is on; yields what switches it off and returns when.

    PX4's is a joystick of the ground station; ArduPilot simulates a receiver.
    """
    if vehicle.autopilot == "ardupilot":

        def fail() -> float:
            vehicle.parameter("SIM_RC_FAIL", 1)
            return time.monotonic()

        try:
            yield fail
        finally:
            vehicle.parameter("SIM_RC_FAIL", 0)
        return
    silent = threading.Event()

    def send_sticks() -> None:
        while not silent.wait(_STICK_PERIOD_S):
            vehicle.station.send_sticks()

    def switch_off() -> float:
        silent.set()
        return time.monotonic()

    vehicle.parameter("NAV_RCL_ACT", 2)
    vehicle.parameter("COM_RCL_EXCEPT", 0)
    threading.Thread(target=send_sticks, daemon=True).start()
    try:
        yield switch_off
    finally:
        silent.set()
