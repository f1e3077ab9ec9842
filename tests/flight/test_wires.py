"""The same flight of either autopilot over each wire, signed and not; the truth judges."""

import pytest

from companion.demo import wire_like
from tests.flight.sockets import fly, mock_vehicle

WIRES = {"udp": None, "tcp": "tcp://127.0.0.1:1", "serial": "serial:///dev/any:921600"}


@pytest.mark.parametrize(
    ("autopilot", "wire", "signs"),
    [  # each pair of two of the three
        ("px4", "udp", True),
        pytest.param("px4", "tcp", False, marks=pytest.mark.slow),
        ("px4", "serial", True),
        ("ardupilot", "udp", False),
        ("ardupilot", "tcp", True),
        pytest.param("ardupilot", "serial", False, marks=pytest.mark.slow),
    ],
)
def test_the_same_flight_over_each_wire(autopilot, wire, signs, tmp_path):
    key = tmp_path / "key"
    key.write_text("a passphrase\n")
    theirs = {"signing": {"passphrase_file": str(key)}} if signs else {}
    ours = {"signing_key_file": str(key)} if signs else {}
    if WIRES[wire] is None:
        summary, truth = flown(tmp_path, autopilot, theirs, ours)
    else:
        with wire_like(WIRES[wire]) as made:
            endpoint = {"endpoint": made.endpoint}
            theirs["endpoint"] = made.vehicle[1]
            summary, truth = flown(tmp_path, autopilot, theirs, ours | endpoint)
    assert (summary.result, summary.phase) == ("ok", "disarm")
    assert not truth["armed"]
    assert not truth["crashed"]
    assert truth["setpoints"] > 250
    if signs:
        assert truth["signing"]["accepted"] > 250
        assert truth["signing"]["unsigned"] == truth["signing"]["refused"] == 0
    said = [text for _, text in summary.events]
    assert not any("its frames" in text for text in said)
    assert ("autopilot: Armed by external command" in said) == (autopilot == "px4")


def flown(folder, autopilot, theirs, ours):
    """Summary and truth of a short hover."""
    with mock_vehicle(folder, autopilot=autopilot, **theirs) as mock:
        mock.state()  # it is there
        summary = fly(mock, folder / "flight", link=ours, hover={"duration_s": 1.0})
        return summary, mock.state()
