"""What says that another vehicle may stand where the checked one stood, and what follows."""

from types import SimpleNamespace

import pytest

from companion.flight.vehicle_identity import ReplacementDetector, VehicleReplaced
from companion.preflight.evidence import Identity
from companion.safety.actions import Exit, FlightEnded


class Link(SimpleNamespace):
    """As much of a link as tells one vehicle from another; its clock is set by hand."""

    def __init__(self):
        super().__init__(
            now=0.0,
            stats=SimpleNamespace(peers=0, frames=0),
            timesync=SimpleNamespace(restart_count=0),
            clock=SimpleNamespace(restart_count=0, last_change="its clock went back by 40.0 s"),
        )
        self.vehicle = ReplacementDetector(self, lambda: self.now)

    def pass_time(self, seconds, *, heard=True, step=0.02):
        """Look as the watch does."""
        for _ in range(round(seconds / step)):
            self.now += step
            self.stats.frames += heard
            self.vehicle.update()


def checked():
    link = Link()
    link.pass_time(1.0)
    link.vehicle.begin()
    link.vehicle.note_identity(Identity(uid="a1"))
    return link, link.vehicle


def another_peer(link):
    link.stats.peers += 1


def a_restart(link):
    link.clock.restart_count += 1


def another_id(link):
    link.vehicle.note_identity(Identity(uid="b2"))


def a_silence(link):
    link.pass_time(2.1, heard=False)
    link.pass_time(0.02)


CHANGES = {
    another_peer: "heard from another address or connection",
    a_restart: "may have restarted: its clock went back by 40.0 s",
    another_id: "another vehicle answers: hardware id b2, not a1",
    a_silence: "was not heard for 2.1 s",
}


@pytest.mark.parametrize("change", CHANGES, ids=lambda change: change.__name__)
def test_before_arming_it_voids_the_checks_which_can_be_made_anew(change):
    link, vehicle = checked()
    vehicle.require()
    change(link)
    assert not vehicle.is_same_vehicle
    with pytest.raises(VehicleReplaced, match=CHANGES[change]):
        vehicle.require()
    vehicle.begin()
    vehicle.require()
    assert vehicle.is_same_vehicle


@pytest.mark.parametrize("change", [another_peer, a_restart, another_id])
def test_once_armed_it_ends_the_flight(change):
    link, vehicle = checked()
    vehicle.note_arming()
    change(link)
    with pytest.raises(FlightEnded, match=CHANGES[change]) as ended:
        vehicle.require()
    assert ended.value.exit is Exit.RELEASE
    assert not isinstance(ended.value, VehicleReplaced)


def test_once_armed_silence_is_the_watchs_matter():
    link, vehicle = checked()
    vehicle.note_arming()
    a_silence(link)
    vehicle.require()
    assert vehicle.is_same_vehicle


def test_a_sample_after_a_silence_is_not_answered_before_the_watch_looked():
    link, vehicle = checked()
    link.pass_time(2.1, heard=False)
    vehicle.require()  # it may come back, and then it counts
    assert not vehicle.is_same_vehicle


def test_the_same_vehicle_is_the_same():
    link, vehicle = checked()
    for _ in range(3):
        link.pass_time(1.9, heard=False)
        link.pass_time(0.02)
        vehicle.note_identity(Identity(uid="a1"))
        vehicle.note_identity(Identity())  # not told this time
    vehicle.require()
    assert vehicle.is_same_vehicle


def test_a_stall_of_our_own_is_no_silence():
    link, vehicle = checked()
    link.pass_time(5.0, heard=False, step=5.0)
    link.pass_time(0.02)
    vehicle.require()
    assert vehicle.is_same_vehicle


def test_what_was_before_the_checks_does_not_count():
    link = Link()
    for change in (another_peer, a_restart, a_silence):
        change(link)
    link.vehicle.require()
    link.vehicle.begin()
    link.vehicle.require()
    assert link.vehicle.is_same_vehicle
