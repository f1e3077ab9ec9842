"""A task of the link fails in flight: the flight must not go on without what it did."""

import pytest

from companion.mavlink.outbox import Outbox
from companion.vehicle.timesync import TimeSync
from tests.flight.fly import fly, mock_vehicle


@pytest.mark.parametrize(
    ("sender", "name"), [(Outbox, "send_heartbeat"), (TimeSync, "send_exchange_request")]
)
def test_a_task_of_the_link_that_fails_in_flight_ends_the_flight(sender, name, monkeypatch):
    with mock_vehicle() as mock:

        def fail_in_flight():
            if mock.time > 7.0:
                raise ZeroDivisionError("a fault of ours")

        send = getattr(sender, name)

        def failing(self):
            fail_in_flight()
            send(self)

        monkeypatch.setattr(sender, name, failing)
        summary = fly(mock, hover={"duration_s": 8.0})
        state = mock.state()
    assert summary.result == "internal error: ZeroDivisionError('a fault of ours')", summary.events
    assert (state["armed"], state["crashed"]) == (False, False)
