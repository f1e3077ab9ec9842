"""What is flown on a real autopilot: the rows of docs/exits.md, and what only a real one shows.

Each function flies once and returns its figures; times in s after the event, distances in m.
"""

import random
import signal
import time
from math import hypot

from pymavlink.dialects.v20 import common

from tests.real import lost_transmitter
from tests.real.lost_control import lost_in_takeoff, own_fence
from tests.real.next_flights import left_by_failsafe, left_by_ladder
from tests.real.outcome import figures

FROZEN_GUIDANCE = """
from companion.control.guidance_loop import GuidanceLoop
flown = GuidanceLoop.step
def freezing(guide):
    if guide.flown_source.begun_at is None or guide._clock() < guide.flown_source.begun_at + 5.0:
        flown(guide)
GuidanceLoop.step = freezing
"""
NEW_MODES = {"px4": ("LOITER", "LAND", "RTL"), "ardupilot": ("LOITER", "LAND", "ALT_HOLD")}


def good_end(vehicle):
    flight = vehicle.fly(hover={"duration_s": 8.0})
    flight.until_obeyed()
    event = time.monotonic() + 8.0
    flight.finish()
    return figures(vehicle, flight, event, 30.0)


def interrupted(vehicle, number):
    flight = vehicle.hovering()
    event = flight.send(number)
    flight.finish()
    return figures(vehicle, flight, event)


def second_ctrl_c(vehicle):
    """The uplink is cut, else it holds before the second one comes; PX4 is to wait for that."""
    if vehicle.autopilot == "px4":
        vehicle.parameter("COM_OF_LOSS_T", 3.0)
    flight = vehicle.hovering(flight={"accept": ["COM_OF_LOSS_T", "safety.offboard_loss"]})
    vehicle.relay.plug(up=False, down=True)
    event = flight.send(signal.SIGINT)
    time.sleep(1.3)
    flight.send(signal.SIGINT)
    flight.finish()
    vehicle.relay.plug(up=True, down=True)
    try:
        return figures(vehicle, flight, event)
    finally:
        if vehicle.autopilot == "px4":
            vehicle.parameter("COM_OF_LOSS_T", 1.0)


def killed(vehicle):
    flight = vehicle.hovering()
    event = flight.send(signal.SIGKILL)
    flight.process.wait()
    return figures(vehicle, flight, event)


def stopped(vehicle, seconds=3.0):
    flight = vehicle.hovering()
    event = flight.send(signal.SIGSTOP)
    time.sleep(seconds)
    flight.send(signal.SIGCONT)
    flight.finish()
    return figures(vehicle, flight, event)


def frozen_guidance(vehicle):
    flight = vehicle.fly(prelude=FROZEN_GUIDANCE)
    flight.until_obeyed()
    flight.finish()
    last = vehicle.relay.setpoints[-1]
    return figures(vehicle, flight, last - 0.5)


def unplugged(vehicle):
    flight = vehicle.hovering()
    vehicle.relay.plug(up=False, down=False)
    event = time.monotonic()
    flight.finish()
    return figures(vehicle, flight, event)


def link_lost(vehicle, maneuver="hover"):
    """The cable is unplugged for less than PX4's failsafe waits, or for 2 s."""
    flight = vehicle.hovering(flight={"maneuvers": [maneuver]})
    vehicle.relay.plug(up=False, down=False)
    event = time.monotonic()
    time.sleep(0.75 if vehicle.autopilot == "px4" else 2.0)
    vehicle.relay.plug(up=True, down=True)
    flight.finish()
    return figures(vehicle, flight, event, events=flight.result.get("events", [])[-4:])


def battery(vehicle):
    """PX4's simulated battery drains to half in a minute, ArduPilot's by 5 % in a short flight."""
    if vehicle.autopilot == "px4":
        vehicle.parameter("SIM_BAT_DRAIN", 60.0)
    least = {"px4": 75.0, "ardupilot": 96.0}[vehicle.autopilot]
    flight = vehicle.fly(limits={"min_battery_percent": least})
    flight.until_obeyed()
    station = vehicle.station
    event = station.until(lambda: not station.obeys, 150.0, "end of our control")
    flight.finish()
    return figures(vehicle, flight, event, 25.0)


def pilot(vehicle, after=None):
    """A mode change by a second link, at a random moment."""
    mode = random.choice(NEW_MODES[vehicle.autopilot])
    flight = vehicle.hovering(random.uniform(2.0, 4.0) if after is None else after)
    event = vehicle.station.set_mode(mode)
    flight.finish()
    return figures(vehicle, flight, event, 3.0, chosen=mode)


def no_gps(vehicle):
    if vehicle.autopilot == "px4":
        off = lambda: vehicle.parameter("SIM_GPS_USED", 0)  # noqa: E731
        on = lambda: vehicle.parameter("SIM_GPS_USED", 10)  # noqa: E731
    else:
        off = lambda: vehicle.parameter("SIM_GPS1_ENABLE", 0)  # noqa: E731
        on = lambda: vehicle.parameter("SIM_GPS1_ENABLE", 1)  # noqa: E731
    flight = vehicle.hovering()
    event = time.monotonic()
    off()
    flight.finish()
    try:
        return figures(vehicle, flight, event, 25.0)
    finally:
        on()
        time.sleep(5.0)


def wrong_height(vehicle):
    """The barometer jumps up; the estimate follows without a reset. Only ArduPilot believes it."""
    name, jump = {"px4": ("SIM_BARO_OFF_P", 0.6), "ardupilot": ("SIM_BARO_GLITCH", 6.0)}[
        vehicle.autopilot
    ]  # hPa, m
    flight = vehicle.hovering(hover={"duration_s": 15.0})
    event = time.monotonic()
    vehicle.parameter(name, jump)
    time.sleep(5.0)
    vehicle.parameter(name, 0.0)
    flight.finish()
    return figures(vehicle, flight, event, 25.0)


def out_of_the_fence(vehicle):
    """Blown out by a gust; a planned leaving is refused before take-off."""
    names = {"px4": "SIH_WIND_N", "ardupilot": "SIM_WIND_SPD"}
    speed = {"px4": 18.0, "ardupilot": 60.0}[vehicle.autopilot]
    flight = vehicle.hovering(limits={"fence_radius_m": 2.0})
    vehicle.parameter(names[vehicle.autopilot], speed)
    station = vehicle.station
    event = station.until(lambda: not station.obeys, 60.0, "end of our control")
    vehicle.parameter(names[vehicle.autopilot], 0.0)
    flight.finish()
    return figures(vehicle, flight, event, 25.0)


def attitude_lowered(vehicle, rate_hz=5.0, times=1):
    """Another program on our link asks for less attitude than we fly by, on a circle."""
    radius = 5.0
    circle = {"radius_m": radius, "speed_m_s": 3.0, "laps": 4.0}
    flight = vehicle.hovering(6.0, flight={"maneuvers": ["circle"]}, circle=circle)
    began = vehicle.relay.setpoints[-1] - 6.0
    sender = common.MAVLink(None, srcSystem=255, srcComponent=190)
    lower = common.MAVLink_command_long_message(1, 1, 511, 0, 31, 1e6 / rate_hz, 0, 0, 0, 0, 0)
    event = time.monotonic()
    for _ in range(times):
        vehicle.relay.inject(lower.pack(sender))
        time.sleep(0.3)
    flight.finish()
    sent = sum(at > event for at in vehicle.relay.setpoints)
    # It lies north of where control began.
    seen = vehicle.station.seen
    start = next(row for row in seen if row.time > began)
    off = [
        abs(hypot(row.north - start.north - radius, row.east - start.east) - radius)
        for row in seen
        if event < row.time < event + 3.0
    ]
    return figures(vehicle, flight, event, setpoints_after=sent, off_circle_m=round(max(off), 2))


def hover_minutes(vehicle, minutes=10.0):
    """As docs/companion-computer.md advises for a computer that has other work, too."""
    realtime = {"scheduler": "fifo", "lock_memory": True, "freeze_gc": True}
    flight = vehicle.fly(hover={"duration_s": 60.0 * minutes}, realtime=realtime)
    event = flight.until_obeyed()
    flight.finish(60.0 * minutes + 180.0)
    result, flown = flight.result, round(time.monotonic() - event)
    vehicle.bring_down()
    return {
        "result": result.get("result"),
        "events": [event["text"] for event in result.get("events", [])],
        "counts": result.get("counts"),
        "flown_s": flown,
        **vehicle.station.motion_since(event, event + 60.0 * minutes),
        "load": vehicle.load(),
    }


ROWS = {
    "good_end": good_end,
    "ctrl_c": lambda vehicle: interrupted(vehicle, signal.SIGINT),
    "sigterm": lambda vehicle: interrupted(vehicle, signal.SIGTERM),
    "sighup": lambda vehicle: interrupted(vehicle, signal.SIGHUP),
    "second_ctrl_c": second_ctrl_c,
    "killed": killed,
    "stopped": stopped,
    "frozen_guidance": frozen_guidance,
    "unplugged": unplugged,
    "link_lost": link_lost,
    "link_lost_on_circle": lambda vehicle: link_lost(vehicle, "circle"),
    "lost_in_takeoff": lost_in_takeoff,
    "own_fence": own_fence,
    "transmitter_in_climb": lost_transmitter.lost_in_climb,
    "transmitter_before_control": lost_transmitter.lost_before_control,
    "transmitter_in_control": lost_transmitter.lost_in_control,
    "battery": battery,
    "pilot": pilot,
    "no_gps": no_gps,
    "wrong_height": wrong_height,
    "fence": out_of_the_fence,
    "attitude_lowered": attitude_lowered,
    "attitude_kept_low": lambda vehicle: attitude_lowered(vehicle, times=10),
    "left_by_failsafe": left_by_failsafe,
    "left_by_ladder": left_by_ladder,
    "hover": hover_minutes,
}
