"""The routing rules of the MAVLink guide, on channels in memory."""

import random
from itertools import pairwise

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from companion.mavlink.framing import FrameScanner
from companion.serve.network.addresses import EVERYBODY, Address, target_of
from companion.serve.network.routing import Routing

AUTOPILOT, OWN = Address(1, 1), Address(1, 191)
GROUND, SCRIPT, CAMERA = Address(255, 190), Address(245, 191), Address(1, 100)
ACK = dialect.MAVLink_command_ack_message


class Ear:
    def __init__(self, name="ear"):
        self.name, self.heard = name, []

    def put(self, frame, origin=None):
        self.heard.append(frame)


def frame(message, source, sequence=0):
    mav = dialect.MAVLink(None, *source)
    mav.seq = sequence
    return FrameScanner(keep_unknown=True).feed(message.pack(mav))[0]


def heartbeat(source, sequence=0):
    return frame(dialect.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3), source, sequence)


def command(target, source, sequence=0):
    message = dialect.MAVLink_command_long_message(*target, 400, 0, 1, 0, 0, 0, 0, 0, 0)
    return frame(message, source, sequence)


class Net:
    """A vehicle and three clients: a ground station, a script, and one that never speaks."""

    def __init__(self):
        self.now = 0.0
        self.vehicle, self.ground, self.script, self.silent = (
            Ear(name) for name in ("vehicle", "ground", "script", "silent")
        )
        self.routing = Routing(self.vehicle, AUTOPILOT, OWN, lambda: self.now)
        self.routing.intercept = lambda *_: False
        for client in (self.ground, self.script, self.silent):
            self.routing.attach(client)
        self.routing.forward_from_client(self.ground, heartbeat(GROUND, 200))
        self.routing.forward_from_client(self.script, heartbeat(SCRIPT, 200))
        self.clear()

    def clear(self):
        for ear in (self.vehicle, self.ground, self.script, self.silent):
            ear.heard.clear()

    def heard(self):
        names = ("vehicle", "ground", "script", "silent")
        return {name for name in names if getattr(self, name).heard}


@pytest.fixture
def net():
    return Net()


def test_every_targeted_message_names_its_target_where_pymavlink_puts_it():
    checked = 0
    for number, kind in dialect.mavlink_map.items():
        fields = kind.ordered_fieldnames
        if "target_system" not in fields:
            continue
        values = [0] * len(kind.fieldnames)
        for name, value in (("target_system", 77), ("target_component", 88)):
            if name in fields:
                values[kind.fieldnames.index(name)] = value
        for at, (name, form) in enumerate(zip(kind.fieldnames, kind.fieldtypes, strict=True)):
            length = kind.array_lengths[fields.index(name)]
            if length:
                values[at] = b"" if form == "char" else [0] * length
        found = target_of(frame(kind(*values), GROUND))
        assert found == Address(77, 88 if "target_component" in fields else 0), number
        checked += 1
    assert checked > 80


def test_a_message_without_a_target_is_for_everybody():
    assert target_of(heartbeat(AUTOPILOT)) == EVERYBODY


def test_the_target_of_manual_control_is_a_system():
    message = dialect.MAVLink_manual_control_message(7, 1, 2, 3, 4, 5)
    assert target_of(frame(message, GROUND)) == Address(7, 0)


def test_a_target_that_was_cut_off_as_zero_is_everybody():
    message = dialect.MAVLink_param_request_list_message(0, 0)
    assert target_of(frame(message, GROUND)) == EVERYBODY


def test_telemetry_goes_to_every_client_and_not_back(net):
    sent = heartbeat(AUTOPILOT)
    net.routing.forward_from_vehicle(sent)
    assert net.heard() == {"ground", "script", "silent"}
    assert net.ground.heard == [sent.raw]


def test_an_answer_goes_only_where_its_target_was_heard(net):
    answer = ACK(400, 0, target_system=255, target_component=190)
    net.routing.forward_from_vehicle(frame(answer, AUTOPILOT))
    assert net.heard() == {"ground"}


def test_an_answer_to_all_components_of_a_system_finds_the_system(net):
    answer = ACK(400, 0, target_system=245, target_component=0)
    net.routing.forward_from_vehicle(frame(answer, AUTOPILOT))
    assert net.heard() == {"script"}


def test_an_answer_to_us_ends_here(net):
    answer = ACK(400, 0, target_system=1, target_component=191)
    net.routing.forward_from_vehicle(frame(answer, AUTOPILOT))
    assert net.heard() == set()


def test_an_answer_to_somebody_unheard_is_dropped_and_counted(net):
    answer = ACK(400, 0, target_system=9, target_component=9)
    net.routing.forward_from_vehicle(frame(answer, AUTOPILOT))
    assert net.heard() == set()
    assert net.routing.stats.no_route == 1


@pytest.mark.parametrize("target", [AUTOPILOT, Address(1, 0), Address(1, 154)])
def test_a_command_to_the_vehicle_goes_to_the_vehicle_alone(net, target):
    net.routing.forward_from_client(net.ground, command(target, GROUND))
    assert net.heard() == {"vehicle"}


def test_a_broadcast_of_a_client_goes_to_all_others(net):
    net.routing.forward_from_client(net.ground, command(EVERYBODY, GROUND))
    assert net.heard() == {"vehicle", "script", "silent"}


def test_clients_reach_each_other(net):
    net.routing.forward_from_client(net.ground, command(SCRIPT, GROUND))
    assert net.heard() == {"script"}


def test_a_camera_that_is_a_client_is_not_looked_for_behind_the_vehicle(net):
    net.routing.forward_from_client(net.silent, heartbeat(CAMERA))
    net.clear()
    net.routing.forward_from_client(net.ground, command(CAMERA, GROUND))
    assert net.heard() == {"silent"}


def test_a_station_behind_the_autopilot_is_heard_and_answered(net):
    far = Address(250, 5)
    net.routing.forward_from_vehicle(heartbeat(far))
    assert net.heard() == {"ground", "script", "silent"}
    net.clear()
    net.routing.forward_from_client(net.ground, command(far, GROUND))
    assert net.heard() == {"vehicle"}


def test_a_command_to_us_is_handed_over_and_not_forwarded(net):
    taken = []
    net.routing.on_own_frame = lambda client, got: taken.append((client, got.message_id))
    net.routing.forward_from_client(net.ground, command(OWN, GROUND))
    assert (net.heard(), taken) == (set(), [(net.ground, 76)])


def test_what_is_intercepted_is_not_forwarded(net):
    net.routing.intercept = lambda _, got: got.message_id == 76
    net.routing.forward_from_client(net.ground, command(AUTOPILOT, GROUND))
    net.routing.forward_from_client(net.ground, heartbeat(GROUND))
    assert len(net.vehicle.heard) == 1


@pytest.mark.parametrize("source", [AUTOPILOT, OWN])
def test_a_client_that_claims_to_be_the_autopilot_or_us_is_not_heard(net, source):
    net.routing.forward_from_client(net.ground, heartbeat(source))
    assert net.heard() == set()
    assert net.routing.stats.looped == 1
    assert not net.routing.is_at_client(source, net.silent)


def test_a_program_under_our_ids_is_told_but_not_an_echo_of_ours(net):
    """191 is the usual id of a companion computer: such a program met silence, without a word."""
    told = []
    net.routing.on_our_ids_used = told.append
    ours = heartbeat(OWN, 7)
    net.routing.send_to_clients(ours.raw)
    net.routing.forward_from_client(net.script, ours)  # a router behind it sends it back
    net.routing.forward_from_client(net.script, heartbeat(AUTOPILOT, 8))
    assert told == []
    net.routing.forward_from_client(net.script, heartbeat(OWN, 9))
    assert told == [net.script]


def test_our_own_frames_that_the_vehicle_returns_are_dropped(net):
    net.routing.forward_from_vehicle(heartbeat(OWN))
    assert net.heard() == set()


def test_a_frame_that_comes_back_over_another_client_is_dropped(net):
    sent = heartbeat(GROUND, 7)
    net.routing.forward_from_client(net.ground, sent)
    net.clear()
    net.routing.forward_from_client(net.script, sent)
    net.routing.forward_from_vehicle(sent)
    assert net.heard() == set()
    assert net.routing.stats.looped == 2


def test_two_bridged_clients_do_not_make_a_storm(net):
    """Whatever ground hears is sent by script again, and the other way round."""
    net.routing.forward_from_client(net.ground, heartbeat(GROUND, 9))
    for _ in range(50):
        for origin, other in ((net.ground, net.script), (net.script, net.ground)):
            heard, other.heard = other.heard, []
            for raw in heard:
                net.routing.forward_from_client(origin, FrameScanner().feed(raw)[0])
    assert len(net.vehicle.heard) == 1


def test_a_sender_without_running_numbers_is_heard_each_time(net):
    for _ in range(5):
        net.now += 1.0
        net.routing.forward_from_client(net.ground, heartbeat(GROUND, 0))
    assert len(net.vehicle.heard) == 5


def test_a_stream_without_running_numbers_is_never_silent_for_long(net):
    """At 10 Hz, its setpoints are older than serve.setpoint_timeout_ms at no time."""
    passed = []
    for number in range(100):
        net.now += 0.1
        before = len(net.vehicle.heard)
        net.routing.forward_from_client(net.ground, heartbeat(GROUND, 0))
        passed += [number] * (len(net.vehicle.heard) - before)
    assert max(b - a for a, b in pairwise(passed)) <= 3


def test_the_same_frame_later_from_another_client_is_no_repetition(net):
    net.routing.forward_from_client(net.ground, heartbeat(GROUND, 3))
    net.now += 1.0
    net.routing.forward_from_client(net.script, heartbeat(GROUND, 3))
    assert len(net.vehicle.heard) == 2


def test_a_client_that_left_receives_nothing(net):
    net.routing.detach(net.ground)
    net.routing.forward_from_vehicle(heartbeat(AUTOPILOT))
    net.routing.forward_from_vehicle(
        frame(ACK(1, 0, target_system=255, target_component=190), AUTOPILOT)
    )
    assert net.heard() == {"script", "silent"}


def unknown(source, number=50_123, payload=b"\x05\x06\x07"):
    head = bytes([0xFD, len(payload), 0, 0, 1, *source]) + number.to_bytes(3, "little")
    return head + payload + b"\xaa\xbb"


def test_an_unknown_message_is_forwarded_untouched(net):
    raw = unknown(AUTOPILOT)
    (got,) = FrameScanner(keep_unknown=True).feed(raw)
    assert (got.raw, got.message_id, got.system) == (raw, 50_123, 1)
    net.routing.forward_from_vehicle(got)
    assert net.ground.heard == net.script.heard == [raw]


def test_unknown_messages_keep_their_place_between_known_ones():
    before, after = heartbeat(AUTOPILOT, 1).raw, heartbeat(AUTOPILOT, 3).raw
    data = before + unknown(AUTOPILOT) + after
    scanner = FrameScanner(streaming=True, keep_unknown=True)
    found = [each.raw for at in range(0, len(data), 5) for each in scanner.feed(data[at : at + 5])]
    assert found == [before, unknown(AUTOPILOT), after]
    assert [each.raw for each in FrameScanner().feed(data)] == [before, after]


def test_signed_and_version_1_frames_are_forwarded_byte_for_byte(net):
    mav = dialect.MAVLink(None, *AUTOPILOT)
    mav.signing.secret_key, mav.signing.sign_outgoing = bytes(32), True
    mav.signing.link_id, mav.signing.timestamp = 3, 10**12
    signed = dialect.MAVLink_heartbeat_message(2, 12, 0, 0, 4, 3).pack(mav)
    old = dialect.MAVLink_heartbeat_message(2, 12, 0, 0, 4, 3).pack(
        dialect.MAVLink(None, *AUTOPILOT), force_mavlink1=True
    )
    for raw in (signed, old):
        (got,) = FrameScanner().feed(raw)
        net.routing.forward_from_vehicle(got)
        assert net.ground.heard[-1] == raw


def test_no_frame_ever_returns_to_its_origin(net):
    random.seed(1)
    addresses = [EVERYBODY, AUTOPILOT, OWN, GROUND, SCRIPT, CAMERA, Address(1, 0), Address(255, 0)]
    for number in range(2000):
        net.clear()
        net.now += 0.01
        source, target = random.choice(addresses), random.choice(addresses)
        origin = random.choice((net.ground, net.script, net.silent))
        net.routing.forward_from_client(origin, command(target, source, number & 0xFF))
        assert origin.heard == []


def test_until_somebody_judges_them_no_frame_of_a_client_is_forwarded():
    vehicle, client = Ear("vehicle"), Ear("client")
    routing = Routing(vehicle, AUTOPILOT, OWN, lambda: 0.0)
    routing.attach(client)
    routing.forward_from_client(client, command(AUTOPILOT, GROUND))
    assert not vehicle.heard
