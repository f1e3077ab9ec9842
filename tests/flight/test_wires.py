"""The same flight over each wire, and signed: one programme, the vehicle's truth as the judge."""

import pytest

from companion.demo import wire_like
from tests.flight.fly import fly, mock_vehicle

HOVER = {"hover": {"duration_s": 1.0}}


@pytest.mark.parametrize("endpoint", ["tcp://127.0.0.1:1", "serial:///dev/any:921600"])
def test_the_same_flight_over_tcp_and_a_serial_line(endpoint, tmp_path):
    with wire_like(endpoint) as wire:
        vehicle_end = wire.vehicle[1]
        with mock_vehicle(tmp_path, endpoint=vehicle_end) as mock:
            mock.state()  # it is there
            summary = fly(mock, tmp_path / "flight", link={"endpoint": wire.endpoint}, **HOVER)
            assert (summary.result, summary.phase) == ("ok", "disarm")
            truth = mock.state()
    assert not truth["armed"]
    assert not truth["crashed"]
    assert truth["setpoints"] > 250
