"""The live stream: what clients of its protocol see of a flight, and what they cannot do."""

import json
import socket
import struct
import sys
import time
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from importlib.util import find_spec

import numpy as np
import pytest
from mcap_ros2._dynamic import generate_dynamic
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from companion.cli.main import main
from companion.config import Config
from companion.config.files import load
from companion.files.yaml_file import ConfigError
from companion.flight.observer import SilentObserver, decline_landing
from companion.flight.session import Session
from companion.live.addresses import stream_address
from companion.live.channel import Feed
from companion.live.helper import Helper, HelperTasks
from companion.recording.flight_record import read_flight
from companion.recording.mcap_file import cdr
from companion.recording.mcap_file.batch import Batch, messages_of
from companion.recording.mcap_file.channels import TOPICS
from companion.testing import run
from companion.testing.flying import environment
from tests.flight.fly import QuickVehicle, quick_flight
from tests.live.pages import status

needs_library = pytest.mark.skipif(
    find_spec("foxglove") is None, reason="the extra `foxglove` is not installed"
)
_MESSAGE, _STATUS = 1, "status"
_CHANNEL = {"id": 1, "topic": "/a", "encoding": "json"}


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    """A recorded flight, and the datagrams that were streamed meanwhile."""
    folder, datagrams = tmp_path_factory.mktemp("flown"), []
    config = quick_flight(
        "px4", {"flight": {"maneuvers": ["circle"]}, "circle": {"radius_m": 2.0, "laps": 1}}
    )
    streaming = replace(environment, send_batch=datagrams.append)
    session = Session(config, folder, SilentObserver(), decline_landing, environment=streaming)
    assert run(QuickVehicle(lockstep=False), session.fly()).result == "ok"
    return read_flight(folder), datagrams


def test_what_is_recorded_is_streamed(flown):
    record, datagrams = flown
    streamed = {topic: [] for topic in TOPICS}
    for datagram in datagrams:
        for number, time_ns, data in messages_of(datagram):
            streamed[list(TOPICS)[number]].append((time_ns, data))
    recorded = record.content.messages
    assert {topic: found for topic, found in streamed.items() if found} == dict(recorded)
    assert len(recorded["/pose"]) > 100
    assert max(map(len, datagrams)) < 100_000


def decoded(record, topic):
    """(time, message) of all messages of a topic."""
    name, schema = TOPICS[topic]
    decode = generate_dynamic(name, schema.decode())[name]
    return [(time_ns, decode(data)) for time_ns, data in record.content.messages[topic]]


def turned(turn, vector):
    """A vector after a rotation by a message's quaternion."""
    axis = np.array([turn.x, turn.y, turn.z])
    across = 2.0 * np.cross(axis, vector)
    return vector + turn.w * across + np.cross(axis, across)


def thrust_arrows(record):
    """(time, thrust, wanted thrust) of the drawings that have both: vectors, m ENU."""
    turns = dict(decoded(record, "/tf"))
    for time_ns, scene in decoded(record, "/scene"):
        for entity in scene.entities:
            if entity.id == "thrust" and len(entity.arrows) == 2 and time_ns in turns:
                assert (entity.frame_id, entity.frame_locked) == ("vehicle", True)
                yield (
                    time_ns * 1e-9,
                    *(
                        turned(
                            turns[time_ns].rotation,
                            turned(each.pose.orientation, [each.shaft_length, 0.0, 0.0]),
                        )
                        for each in entity.arrows
                    ),
                )


def test_the_vehicle_its_paths_and_the_fence_are_drawn(flown):
    record, _ = flown
    setpoints = record.rows("setpoint")
    drawn = list(thrust_arrows(record))
    assert len(drawn) > 30
    for when, thrust, wanted in drawn:
        if not setpoints["received_s"][0] < when < setpoints["received_s"][-1]:
            continue
        row = setpoints[np.searchsorted(setpoints["received_s"], when)]
        east, north, up = thrust / np.linalg.norm(thrust)
        assert (north, east) == pytest.approx(
            (row["measured_north"], row["measured_east"]), abs=0.04
        )
        assert up > 0.8
        east, north, _ = wanted / np.linalg.norm(wanted)
        assert (north, east) == pytest.approx((row["target_north"], row["target_east"]), abs=0.04)

    scenes = decoded(record, "/scene")
    assert 0.09e9 < np.median(np.diff([time_ns for time_ns, _ in scenes])) < 0.11e9
    bodies = [entity for _, scene in scenes for entity in scene.entities if entity.id == "body"]
    assert 1 < len(bodies) < len(scenes) / 5
    (paths,) = decoded(record, "/paths")[-1][1].entities
    reference, path = ([(each.x, each.y) for each in line.points] for line in paths.lines)
    assert np.abs(np.subtract(reference, path)).max() < 0.5
    assert np.ptp(path, axis=0).min() > 3.0

    (fence,) = decoded(record, "/fence")[0][1].entities
    corners = np.array([(each.x, each.y, each.z) for each in fence.lines[0].points])
    limits = load(record.folder / "config.yaml").limits
    radii = np.hypot(*corners[:, :2].T)
    assert radii == pytest.approx(np.full(len(radii), limits.fence_radius_m), abs=0.3)
    heights = limits.fence_floor_m, limits.fence_ceiling_m + 2.0
    assert (corners[:, 2].min(), corners[:, 2].max()) == pytest.approx(heights, abs=0.4)


class Client:
    """Speaks the protocol, and decodes by what the server advertises."""

    def __init__(self, port, **options):
        self._stack = ExitStack()
        url, protocols = f"ws://127.0.0.1:{port}", ["foxglove.sdk.v1"]
        connection = connect(url, subprotocols=protocols, max_size=None, **options)
        self._socket = self._stack.enter_context(connection)
        self.info = json.loads(self._socket.recv(timeout=20))
        self.channels, self._types = {}, {}
        while len(self.channels) < len(TOPICS):
            told = json.loads(self._socket.recv(timeout=20))
            self.channels.update({each["id"]: each for each in told["channels"]})
        wanted = [{"id": number, "channelId": number} for number in self.channels]
        self.tell(op="subscribe", subscriptions=wanted)

    def tell(self, **message):
        self._socket.send(json.dumps(message))

    def messages(self, seconds=20.0):
        """(topic, time, decoded message), or (status, level, text), as they come."""
        while True:
            data = self._socket.recv(timeout=seconds)
            if isinstance(data, str):
                told = json.loads(data)
                yield told["op"], told["level"], told["message"]
                continue
            kind, number, time_ns = struct.unpack_from("<BIQ", data)
            assert kind == _MESSAGE
            channel = self.channels[number]
            assert channel["encoding"] == "cdr"
            assert channel["schemaEncoding"] == "ros2msg"
            yield channel["topic"], time_ns, self._decode(channel, data[13:])

    def _decode(self, channel, data):
        name = channel["schemaName"]
        if name not in self._types:
            self._types[name] = generate_dynamic(name, channel["schema"])[name]
        return self._types[name](data)

    def until(self, text):
        """All messages up to a log message, or a word of the server, that begins with `text`."""
        found, words = [], ""
        coming = self.messages()
        while not words.startswith(text):
            found.append(next(coming))
            topic, _, message = found[-1]
            words = message if topic == _STATUS else getattr(message, "message", "")
        return found

    def close(self):
        self._stack.close()


@contextmanager
def served():
    """A helper process that serves the stream, and its address."""
    address = stream_address("0")
    helper = Helper(HelperTasks(None, Config(), None, address, True, None), Config())
    try:
        yield helper, address
        helper._process.wait(30.0)
    finally:
        helper.close("the test is over")
        helper._process.kill()
        helper._process.wait(30.0)


def connected(address, **options):
    deadline = time.monotonic() + 30.0
    while True:
        try:
            return Client(address.port, **options)
        except OSError:
            assert time.monotonic() < deadline
            time.sleep(0.05)


def send(feed, datagram):
    """Send for certain: the flight drops what does not fit into the buffer."""
    dropped = feed.dropped
    feed.send(datagram)
    while feed.dropped > dropped:
        time.sleep(0.01)
        dropped = feed.dropped
        feed.send(datagram)


def say(feed, text):
    batch = Batch(lambda datagram: send(feed, datagram))
    batch.add("/log", 5, cdr.log_message(5, 2, text, "flight"))
    batch.send()


def is_subscribed(feed, client):
    """Wait until a client gets what is sent."""
    for _ in range(100):
        say(feed, "are you there?")
        try:
            next(client.messages(0.2))
        except TimeoutError:
            continue
        say(feed, "begin")
        client.until("begin")
        return
    raise AssertionError("no message arrives")


@needs_library
@pytest.mark.timeout(120)
def test_clients_see_the_flight_and_its_end_and_the_next_flight_takes_the_port(flown):
    record, sent = flown
    with served() as (helper, address):
        first = connected(address)
        assert first.info["capabilities"] == []
        ours = {topic: (kind.name, kind.schema.decode()) for topic, kind in TOPICS.items()}
        theirs = {
            each["topic"]: (each["schemaName"], each["schema"]) for each in first.channels.values()
        }
        assert theirs == ours
        is_subscribed(helper.feed, first)

        seen = []
        for datagram in sent:
            send(helper.feed, datagram)
            say(helper.feed, "so far")
            seen += first.until("so far")[:-1]
        assert len(seen) == len(record.content.topic_order)
        poses = [message.pose.position for topic, _, message in seen if topic == "/pose"]
        assert max(each.x for each in poses) - min(each.x for each in poses) > 1.0
        thrust = [message.thrust for topic, _, message in seen if topic == "/setpoint"]
        assert thrust == pytest.approx(record.rows("setpoint")["thrust"].tolist())

        _refuses_to_be_told(first, address)
        _slow_client_harms_nobody(helper.feed, address, first)
        helper.feed.dropped += 1
        helper.status(status(1.0))
        assert "missing" in first.until("messages are missing")[-1][2]

        helper.close("the flight is over")
        first.until("the flight is over")
        late = connected(address)
        late.tell(op="unsubscribe", subscriptionIds=[1])
        assert helper._process.poll() is None
        again = stream_address(str(address.port))  # the next flight: this one's process gives way
        assert again == address
        for client in (first, late):
            client.close()


def _refuses_to_be_told(client, address):
    """No parameters, no services, no messages of clients, and no other protocol."""
    url = f"ws://127.0.0.1:{address.port}"
    with pytest.raises(InvalidStatus), connect(url, subprotocols=["other.v1"]):
        pass
    client.tell(op="advertise", channels=[{**_CHANNEL, "schemaName": ""}])
    client.until("Server does not support clientPublish")
    client.tell(op="setParameters", parameters=[{"name": "a", "value": 1}])
    client.until("Server does not support parameters")


def _slow_client_harms_nobody(feed, address, reading):
    """It loses messages; the other client gets all."""
    raw = socket.socket()
    raw.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    raw.connect((address.host, address.port))
    slow = Client(address.port, sock=raw, max_queue=1)
    is_subscribed(feed, slow)
    count = 1500
    for _ in range(count // 100):
        for _ in range(100):
            say(feed, "x" * 10_000)
        say(feed, "batch")
        got = reading.until("batch")
        assert len([each for each in got if each[0] == "/log"]) >= 101
    say(feed, "last one")
    reading.until("last one")
    assert len(slow.until("last one")) < count
    slow.close()


def test_a_process_that_does_not_read_costs_the_recording_nothing():
    feed, theirs = Feed.pair()
    for _ in range(500):
        feed.send(bytes(30_000))
    assert feed.dropped > 400
    theirs.close()
    feed.send(b"later")
    assert feed.dropped > 401
    feed.close()
    feed.send(b"too late")


def test_an_address_that_cannot_be_used_is_one_sentence():
    with pytest.raises(ConfigError, match="--foxglove nowhere: write an IP address, a port"):
        stream_address("nowhere")
    assert stream_address(":0").host == "127.0.0.1"
    assert "ws://[::1]:" in stream_address("[::1]:0").address_text()


def test_a_port_in_use_and_a_missing_extra_are_usage_errors(monkeypatch, capsys):
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        assert main(["demo", "--foxglove", str(port)]) == 2
    assert f"--foxglove: cannot listen at port {port}" in capsys.readouterr().err
    assert main(["demo", "--live", str(port), "--foxglove", str(port)]) == 2
    assert f"--foxglove: cannot listen at port {port}" in capsys.readouterr().err
    monkeypatch.setitem(sys.modules, "foxglove", None)
    assert main(["demo", "--foxglove", "0"]) == 2
    assert "[foxglove]'" in capsys.readouterr().err
