"""Keys that fit and keys that do not, both ways, over the real socket; wrong system ids too."""

import time
from pathlib import Path

import pytest

from companion.demo import local_endpoints
from companion.mavlink import lockstep
from companion.mavlink import loop as link_loop
from companion.mavlink.errors import LinkTimeout
from companion.mavlink.settings import LinkSettings
from companion.mavlink.signing import Signing, key_from_passphrase_file
from companion.vehicle.link import Link
from tests.flight.sockets import mock_vehicle, session_for


@pytest.fixture
def keys(tmp_path):
    for name in ("right", "wrong"):
        (tmp_path / name).write_text(f"{name} passphrase\n")
    return {name: str(tmp_path / name) for name in ("right", "wrong")} | {None: None}


def signed(key):
    return {"signing": {"passphrase_file": key}} if key else {}


@pytest.mark.parametrize(
    ("theirs", "ours", "said"),
    [
        ("right", "wrong", "signs its frames with another key"),
        (None, "right", "does not sign its frames"),
        ("right", None, "signs its frames and we do not"),
    ],
)
def test_keys_that_do_not_fit(theirs, ours, said, keys, tmp_path):
    """Nothing is obeyed, and why is said once. By TCP, where both sides speak from the start."""
    with (
        local_endpoints("tcp://127.0.0.1:1") as endpoints,
        mock_vehicle(
            tmp_path,
            in_lockstep=False,
            endpoint=endpoints.vehicle_arguments[1],
            **signed(keys[theirs]),
        ) as mock,
    ):
        mock.state()  # it is there
        summary = flown(mock, tmp_path, endpoint=endpoints.program, signing_key_file=keys[ours])
        truth = mock.state()
    assert sum(said in text for _, text in summary.events) == 1
    assert (truth["armed"], truth["setpoints"], truth["mode"]) == (False, 0, "LOITER")
    if theirs is None:
        assert "frames that are not signed with the key" in summary.result
    else:
        assert truth["signing"]["accepted"] == 0
        assert truth["signing"]["unsigned" if ours is None else "refused"] > 0


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
def test_with_the_clock_months_back_the_vehicle_is_heard_and_obeys(autopilot, keys, tmp_path):
    """It refuses stamps that are older than what it knows, so ours must follow its own."""
    key, notices = key_from_passphrase_file(Path(keys["right"])), []

    async def ask(port):
        ours = Signing(key, clock=lambda: time.time() - 90 * 86400.0)
        settings = LinkSettings(f"udpin://127.0.0.1:{port}", signing=ours)
        async with Link(settings, notice=notices.append) as link:
            await link.wait_connected(10.0)
            await link.request_message("AUTOPILOT_VERSION")

    with mock_vehicle(
        tmp_path, in_lockstep=False, autopilot=autopilot, **signed(keys["right"])
    ) as mock:
        mock.state()
        link_loop.run(ask(mock.port))
        truth = mock.state()
    assert truth["signing"]["accepted"] > 0
    assert truth["signing"]["refused"] == 0
    assert any("days behind the vehicle, which has the right key" in notice for notice in notices)


def test_another_system_id_is_not_heard(tmp_path):
    with mock_vehicle(tmp_path, in_lockstep=False) as mock:
        mock.state()
        summary = flown(mock, tmp_path, target_system=2)
        truth = mock.state()
    assert "no heartbeat from system 2" in summary.result
    assert "such as system/component 1/1; is link.target_system right?" in summary.result
    assert (truth["armed"], truth["setpoints"]) == (False, 0)


def flown(mock, folder, **link):
    """The summary of a flight in real time that gives up after a second without a heartbeat."""
    session = session_for(mock, folder / "flight", link=link, flight={"connect_timeout_s": 1.0})
    return link_loop.run(session.fly())


def test_without_a_beacon_that_is_signed_lockstep_says_why(keys, tmp_path):
    async def connect(settings):
        async with Link(settings):
            pass

    with mock_vehicle(tmp_path, **signed(keys["right"])) as mock:
        settings = LinkSettings(
            f"udpin://127.0.0.1:{mock.port}",
            signing=Signing(bytes(32)),
            lockstep=True,
            first_beacon_timeout_s=2.0,
        )
        with pytest.raises(LinkTimeout, match="frames that are not signed with the key"):
            lockstep.run(connect(settings))
