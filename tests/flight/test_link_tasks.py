"""A task of the link fails in flight: the flight must not go on without what it did."""

import pytest

from companion.vehicle import link as link_module
from companion.vehicle.presence import TimeSync
from tests.flight.fly import fly, mock_vehicle


@pytest.mark.parametrize("task", ["heartbeats", "TIMESYNC"])
def test_a_task_of_the_link_that_fails_in_flight_ends_the_flight(task, monkeypatch):
    with mock_vehicle() as mock:

        def fail_in_flight():
            if mock.time > 7.0:
                raise ZeroDivisionError("a fault of ours")

        if task == "TIMESYNC":
            ask = TimeSync.ask

            def failing_ask(timesync):
                fail_in_flight()
                ask(timesync)

            monkeypatch.setattr(TimeSync, "ask", failing_ask)
        else:
            send = link_module.send_heartbeats

            async def failing_heartbeats(settings, outbox):
                class Failing:
                    def send(self, message):
                        fail_in_flight()
                        return outbox.send(message)

                await send(settings, Failing())

            monkeypatch.setattr(link_module, "send_heartbeats", failing_heartbeats)
        summary = fly(mock, hover={"duration_s": 8.0})
        state = mock.state()
    assert summary.result == "internal error: ZeroDivisionError('a fault of ours')", summary.events
    assert (state["armed"], state["crashed"]) == (False, False)
