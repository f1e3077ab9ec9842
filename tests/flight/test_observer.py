"""Observers that do what they must not: leave the program, or take their time."""

import sys

from companion.flight.observer import EventRecorder, SilentObserver


def recorder_of(on_event, clock=lambda: 0.0):
    class Observer(SilentObserver):
        def event(self, time, text):
            on_event()

    notes = []
    recorder = EventRecorder(Observer(), clock, lambda _: None)
    recorder.note = lambda text: (notes.append(text), recorder.event(0.0, text))
    return recorder, notes


def test_an_observer_that_leaves_the_program_does_not_take_the_flight_along():
    recorder, notes = recorder_of(lambda: sys.exit(3))
    recorder.event(0.0, "mode OFFBOARD")
    assert notes == [
        "the observer of this flight failed and gets no more messages: "
        "RuntimeError('SystemExit(3)')"
    ]


def test_a_slow_observer_is_told_once():
    times = [0.0]

    def wait():
        times[0] += 0.5

    recorder, notes = recorder_of(wait, lambda: times[0])
    for _ in range(3):
        recorder.event(0.0, "armed")
    assert notes == [
        "the observer of this flight took 0.5 s for one message: meanwhile no setpoint is sent and "
        "nothing is supervised; let it return at once"
    ]
