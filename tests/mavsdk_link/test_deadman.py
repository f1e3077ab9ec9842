"""The deadman by itself: what it does when setpoints cease, and what it leaves alone."""

import threading
import time

from companion.mavsdk_link import deadman as room
from companion.mavsdk_link.deadman import SILENCE_LIMIT_S, Deadman


class Watched:
    """A deadman with a stop that is counted."""

    def __init__(self):
        self.stops = []
        self.stopped = threading.Event()
        self.deadman = Deadman(self.stop)

    def stop(self):
        self.stops.append(time.monotonic())
        self.stopped.set()

    def send(self):
        self.deadman.sending(lambda: None)


def test_the_limits_leave_the_autopilot_no_stale_setpoint_after_300_ms():
    assert SILENCE_LIMIT_S + room._LOOK_PERIOD_S < 0.3
    assert SILENCE_LIMIT_S > 0.1  # the longest sample period that a flight is allowed


def test_when_setpoints_cease_it_stops_the_repeating_once():
    watched = Watched()
    watched.send()
    last = time.monotonic()
    assert watched.stopped.wait(5.0)
    assert watched.stops[0] - last >= SILENCE_LIMIT_S - 0.01
    watched.deadman.close()
    assert len(watched.stops) == 1


def test_it_begins_anew_with_the_next_setpoint():
    watched = Watched()
    for _ in range(2):
        watched.send()
        assert watched.stopped.wait(5.0)
        watched.stopped.clear()
    watched.deadman.close()
    assert len(watched.stops) == 2


def test_before_the_first_setpoint_it_has_nothing_to_do():
    watched = Watched()
    time.sleep(2 * room._LOOK_PERIOD_S)
    watched.deadman.close()
    assert watched.stops == []


def test_it_never_stops_in_the_middle_of_sending():
    """MAVSDK's plugin may not be destroyed while it sends: a serial port can hold it up."""
    watched = Watched()

    def held_up():
        time.sleep(2 * SILENCE_LIMIT_S)
        watched.done = time.monotonic()

    watched.deadman.sending(held_up)
    assert watched.stopped.wait(5.0)
    watched.deadman.close()
    assert watched.stops[0] >= watched.done
