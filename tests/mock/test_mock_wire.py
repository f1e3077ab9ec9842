"""Frames: byte for byte against pymavlink, and whatever may come in a datagram."""

import random

from mock_rig import Rig
from pymavlink.dialects.v20 import development as dialect

from sitl_mock.link.framing import Framer, decode


def arbitrary(kind, rng):
    """Return a message of a class with arbitrary field values."""
    values = []
    for name, type_ in zip(kind.fieldnames, kind.fieldtypes, strict=True):
        length = kind.array_lengths[kind.ordered_fieldnames.index(name)]
        if type_ == "char":
            values.append(b"abc" if length else b"a")
        elif length:
            values.append([rng.randrange(120) for _ in range(length)])
        else:
            values.append(rng.randrange(120))
    return kind(*values)


def test_every_message_is_packed_as_pymavlink_packs_it():
    rng = random.Random(1)
    framer, reference = Framer(7, 9), dialect.MAVLink(None, srcSystem=7, srcComponent=9)
    for kind in dialect.mavlink_map.values():
        message = arbitrary(kind, rng)
        expected = bytes(message.pack(reference))
        reference.seq = (reference.seq + 1) % 256
        assert framer.frame(message) == expected, kind.msgname


def contents(message):
    """Return all that a handler can read of a message."""
    fields = {name: getattr(message, name) for name in message.get_fieldnames()}
    header = vars(message.get_header())
    return message.get_type(), repr(fields), header, bytes(message.get_msgbuf())


def test_every_message_is_read_as_pymavlink_reads_it():
    rng = random.Random(4)
    framer, judge = Framer(7, 9), dialect.MAVLink(None)
    for kind in dialect.mavlink_map.values():
        size = kind.unpacker.size
        # Truncated by MAVLink 2, whole, and longer by fields of a newer dialect.
        for length in (1, size // 2 or 1, size, min(size + 3, 255)):
            payload = bytes(rng.randrange(1, 256) for _ in range(length))
            frame = framer.frame_raw(kind.id, kind.crc_extra, payload)
            (message,) = decode(frame)
            assert contents(message) == contents(judge.decode(bytearray(frame))), kind.msgname


def test_several_frames_garbage_and_a_broken_one():
    framer = Framer(255, 190)
    ping = [framer.frame(dialect.MAVLink_ping_message(n, n, 0, 0)) for n in range(3)]
    broken = bytearray(ping[1])
    broken[12] ^= 1
    datagram = b"\xfd\x00garbage" + ping[0] + bytes(broken) + b"\xfe\xff" + ping[2] + b"\xfd\x09"
    assert [m.seq for m in decode(datagram)] == [0, 2]


def test_unknown_incompatibility_flags_are_refused_and_signatures_passed_over():
    frame = bytearray(Framer(255, 190).frame(dialect.MAVLink_ping_message(1, 2, 0, 0)))
    frame[2] = 0x02
    assert decode(bytes(frame)) == []
    mav = dialect.MAVLink(None, srcSystem=255, srcComponent=190)
    mav.signing.secret_key = bytes(32)
    mav.signing.sign_outgoing = True
    signed = bytes(dialect.MAVLink_ping_message(1, 2, 0, 0).pack(mav))
    assert signed[2] == 1
    assert [m.seq for m in decode(signed)] == [2]


def mutated(rng, valid):
    kind = rng.randrange(4)
    if kind == 0:
        return rng.randbytes(rng.randrange(300))
    data = bytearray(rng.choice(valid))
    if kind == 1:
        for _ in range(rng.randrange(1, 6)):
            data[rng.randrange(len(data))] = rng.randrange(256)
    elif kind == 2:
        del data[rng.randrange(len(data)) :]
    else:
        data = data + rng.randbytes(rng.randrange(40)) + data[: rng.randrange(len(data))]
        data[rng.randrange(len(data) // 2)] ^= 1 << rng.randrange(8)
    return bytes(data)


def test_10000_random_and_mutated_datagrams_change_nothing():
    rng = random.Random(2)
    rig, twin = Rig(), Rig()
    framer = Framer(255, 190)
    valid = [framer.frame(arbitrary(kind, rng)) for kind in dialect.mavlink_map.values()]
    passed = 0
    for number in range(10_000):
        datagram = mutated(rng, valid)
        for message in decode(datagram):
            passed += 1
            rig.simulation.handle(message, rig.simulation.companion)
        if number % 100 == 0:
            rig.run(0.004)
            twin.run(0.004)
    # A valid frame may survive a mutation that only adds bytes around it; those are legitimate.
    assert passed < 3500
    assert rig.truth.position_ned == twin.truth.position_ned
    assert rig.state.armed == twin.state.armed
    assert rig.state.mode == twin.state.mode
    parameters = rig.simulation.parameters
    assert {n: parameters[n] for n in parameters} == {
        n: twin.simulation.parameters[n] for n in parameters
    }


def test_every_known_message_with_arbitrary_contents_is_survived():
    rng = random.Random(3)
    rig = Rig()
    framer = Framer(255, 190)
    for _ in range(5):
        for kind in dialect.mavlink_map.values():
            for message in decode(framer.frame(arbitrary(kind, rng))):
                rig.simulation.handle(message, rig.simulation.companion)
    rig.run(1.0)
