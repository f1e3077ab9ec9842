"""The flight after one that ended badly: the vehicle must be ready for it by itself."""

import signal
import time


def left_by_failsafe(vehicle):
    """Killed in flight; after the failsafe's landing the next flight begins by itself."""
    flight = vehicle.hovering()
    event = flight.send(signal.SIGKILL)
    flight.process.wait()
    station = vehicle.station
    station.until(lambda: not station.armed, 90.0, "disarming by the failsafe")
    time.sleep(2.0)
    left = station.mode
    return _next_flight(vehicle, station.modes_since(event), left)


def left_by_ladder(vehicle):
    """Landed by us straight from offboard: the battery's limit."""
    least = {"px4": 75.0, "ardupilot": 96.0}[vehicle.autopilot]
    flight = vehicle.fly(limits={"min_battery_percent": least})
    event = flight.until_obeyed()
    flight.finish(240.0)
    station = vehicle.station
    station.until(lambda: not station.armed, 5.0, "disarming")
    time.sleep(1.5)
    left = station.mode
    modes = station.modes_since(event)
    return {"result": flight.result.get("result"), **_next_flight(vehicle, modes, left)}


def _next_flight(vehicle, modes, left):
    second = vehicle.fly(hover={"duration_s": 3.0}, limits={"min_battery_percent": 5.0})
    began = second.until_obeyed()
    took = round(began - second.began, 1)
    second.finish()
    said = [event["text"] for event in second.result["events"]]
    return {
        "modes": modes,
        "left_in": left,
        "second": second.result["result"],
        "second_obeyed_after": took,
        "asked_to_hold": [text for text in said if "cannot be armed again" in text],
        "load": vehicle.load(),
    }
