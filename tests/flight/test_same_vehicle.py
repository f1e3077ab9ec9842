"""What says that another vehicle may stand where the checked one stood, and what follows."""

from types import SimpleNamespace

import pytest

from companion.doctor.evidence import Identity
from companion.flight.ending import Exit, FlightEnded
from companion.flight.same_vehicle import ChecksVoid, SameVehicle

LIMIT = 1.0


class Link(SimpleNamespace):
    """As much of a link as tells one vehicle from another."""

    def __init__(self):
        super().__init__(
            stats=SimpleNamespace(peers=0),
            clock=SimpleNamespace(restarts=0, last_change="its clock went back by 40.0 s"),
            state=SimpleNamespace(heartbeat=None),
        )

    def hear(self, vehicle, at):
        self.state.heartbeat = SimpleNamespace(received=at)
        vehicle.note_heartbeat()


def checked():
    link = Link()
    vehicle = SameVehicle(link, LIMIT)
    link.hear(vehicle, 0.0)
    vehicle.begin()
    vehicle.note_identity(Identity(uid="a1"))
    return link, vehicle


def another_peer(link, vehicle):
    link.stats.peers += 1


def a_restart(link, vehicle):
    link.clock.restarts += 1


def another_id(link, vehicle):
    vehicle.note_identity(Identity(uid="b2"))


def a_pause(link, vehicle):
    link.hear(vehicle, 1.01)


CHANGES = {
    another_peer: "heard from another address or connection",
    a_restart: "may have restarted: its clock went back by 40.0 s",
    another_id: "another vehicle answers: hardware id b2, not a1",
    a_pause: "was not heard for 1.0 s",
}


@pytest.mark.parametrize("change", CHANGES, ids=lambda change: change.__name__)
def test_before_arming_it_voids_the_checks_which_can_be_made_anew(change):
    link, vehicle = checked()
    vehicle.require()
    change(link, vehicle)
    assert not vehicle.same
    with pytest.raises(ChecksVoid, match=CHANGES[change]):
        vehicle.require()
    vehicle.begin()
    vehicle.require()


@pytest.mark.parametrize("change", [another_peer, a_restart, another_id])
def test_once_armed_it_ends_the_flight(change):
    link, vehicle = checked()
    vehicle.commit()
    change(link, vehicle)
    with pytest.raises(FlightEnded, match=CHANGES[change]) as ended:
        vehicle.require()
    assert ended.value.exit is Exit.LET_GO
    assert not isinstance(ended.value, ChecksVoid)


def test_the_same_vehicle_is_the_same():
    link, vehicle = checked()
    for at in (0.5, 1.4, 2.3):
        link.hear(vehicle, at)
        vehicle.note_identity(Identity(uid="a1"))
        vehicle.note_identity(Identity())  # not told this time
    vehicle.require()
    assert vehicle.same


def test_what_was_before_the_checks_does_not_count():
    link = Link()
    vehicle = SameVehicle(link, LIMIT)
    for change in (another_peer, a_restart, a_pause):
        change(link, vehicle)
    vehicle.require()
    vehicle.begin()
    vehicle.require()
