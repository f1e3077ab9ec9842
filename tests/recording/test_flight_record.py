"""The channels of `flight.mcap`, as our writer writes them, read by our reader and the official."""

import os
from datetime import UTC, datetime

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from zstandard import ZstdError

from companion.cli.main import main
from companion.control.loop_record import UnansweredReason
from companion.files.yaml_file import ConfigError
from companion.recording.flight_record import RECORD_FILE, RecordError, read_flight
from companion.recording.folder import flight_folder, make_named_folder
from companion.recording.mcap_file import cdr, reader, writer
from companion.recording.mcap_file.batch import _FULL_BATCH_BYTES, Batch, messages_of
from companion.recording.mcap_file.channels import CHANNELS, RESOURCES, TOPICS
from companion.recording.mcap_file.loop_channels import (
    ACTION,
    INPUT,
    SETPOINT,
    UNANSWERED_CODES,
    vector_names,
)
from companion.recording.mcap_file.scene import Entity, scene_message
from companion.recording.mcap_file.writer import McapWriter
from companion.recording.measurements.recorded_summary import (
    derived_summary,
    reference_positions,
    summary_of,
)
from companion.recording.recorder import FlightRecorder
from companion.recording.tlog import TLOG_FILE
from companion.replay.entries import recorded_inputs

ROWS = 50


def test_the_reasons_are_those_of_the_control_loop():
    assert UNANSWERED_CODES[2:] == tuple(reason.value for reason in UnansweredReason)


def write(folder):
    """A file with `ROWS` rows in each channel of numbers, and one message in each other."""
    writer = McapWriter(folder / "flight.mcap")
    writer.metadata("flight", {"began_s": "1.0", "epoch_s": "0.0"})
    for row in range(ROWS):
        for channel in CHANNELS:
            numbers = [row + 0.125 * k for k in range(len(channel.numbers))]
            data = channel.packing.pack(cdr.CDR_HEADER, *numbers, *([row % 2] * len(channel.codes)))
            writer.message(channel.topic, row * 4_000_000, data)
        if row == ROWS // 2:
            writer.flush()
    second = 1_000_000_000
    writer.message("/phase", second, cdr.fields_message((1.5,), ("connect", "a heartbeat é")))
    writer.message("/maneuver", second, cdr.fields_message((2.0, 3.0), ("hover",)))
    writer.message("/maneuver", second, cdr.fields_message((4.0, 5.0), ("",)))
    writer.message("/alarm", second, cdr.fields_message((3.0, 1.0), ("fence", "too far", "land")))
    values = '{"limits": {"max_tilt_deg": 20.0}}'
    writer.message("/change", second, cdr.fields_message((1.5, 0.0), (values,)))
    writer.message("/log", 3 * second, cdr.log_message(3 * second, 3, "armed", "autopilot"))
    writer.message(
        "/tf",
        second,
        cdr.pose_message(second + 7, (1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 1.0), "world", "vehicle"),
    )
    for topic in ("/pose", "/reference"):
        pose = cdr.pose_message(second, (1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 1.0), "world")
        writer.message(topic, second, pose)
    for topic in ("/scene", "/paths", "/fence"):
        writer.message(topic, second, scene_message(second, (Entity(topic, "world"),)))
    writer.close()
    return folder / "flight.mcap"


def test_what_is_written_is_read_again_by_both_readers(tmp_path):
    path = write(tmp_path)
    record = read_flight(tmp_path)
    assert record.content.complete
    assert record.content.damage is None
    for channel in CHANNELS:
        rows = record.rows(channel.name)
        assert len(rows) == ROWS
        for number, field in enumerate(channel.numbers):
            assert (rows[field.name] == np.arange(ROWS) + 0.125 * number).all()
        for code in channel.codes:
            assert (rows[code.name] == np.arange(ROWS) % 2).all()
    (phase,), (event,), (alarm,) = record.phases, record.events, record.alarms
    assert phase == (0.5, "connect", "a heartbeat é")
    assert event == (2.0, "armed", 3, "autopilot")
    assert alarm == (2.0, True, "fence", "too far", "land")
    assert record.changes == ((1.5, False, {"limits": {"max_tilt_deg": 20.0}}),)
    assert record.maneuvers == ((2.0, 3.0, "hover"), (4.0, 5.0, None))

    official = {}
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        for schema, channel, _, message in reader.iter_decoded_messages():
            official.setdefault(channel.topic, []).append((schema.name, message))
    assert set(official) == set(TOPICS)
    for channel in CHANNELS:
        newest = official[channel.topic][-1][1]
        for name in channel.dtype.names:
            assert getattr(newest, name) == record.rows(channel.name)[name][-1]
        assert official[channel.topic][0][0] == channel.type.name
    assert official["/log"][0][1].message == "armed"
    assert official["/tf"][0][1].child_frame_id == "vehicle"
    assert official["/tf"][0][1].translation.z == 3.0
    assert official["/pose"][0][1].pose.orientation.w == 1.0
    assert official["/fence"][0][1].entities[0].id == "/fence"
    assert official["/phase"][0][1].waits_for == "a heartbeat é"


def test_a_file_cut_off_anywhere_gives_all_chunks_before(tmp_path):
    path = write(tmp_path)
    data = path.read_bytes()
    found = []
    for end in np.linspace(0, len(data) - 1, 60).astype(int):
        path.write_bytes(data[:end])
        try:
            record = read_flight(tmp_path)
        except RecordError:
            found.append(-1)
        else:
            assert not record.content.complete
            found.append(len(record.rows("sample")))
    assert found == sorted(found)
    assert set(found) == {-1, 0, ROWS // 2 + 1, ROWS}


@pytest.mark.parametrize("content", [b"", b"no mcap at all", b"\x89MCAP0\r\n"])
def test_another_file_is_refused_with_its_name(tmp_path, content):
    (tmp_path / "flight.mcap").write_bytes(content)
    with pytest.raises(RecordError, match=r"flight\.mcap: not the record of a flight"):
        read_flight(tmp_path)


@pytest.mark.parametrize("command", ["report", "plot", "replay", "export --csv", "compare"])
def test_the_folder_above_the_flights_is_answered_with_the_newest(tmp_path, command, capsys):
    for name in ("2026-11-22T10-54-16Z", "2026-11-26T12-45-09Z"):
        (tmp_path / name).mkdir()
        write(tmp_path / name)
    assert main([*command.split(), str(tmp_path)]) == 2
    newest = tmp_path / "2026-11-26T12-45-09Z"
    assert capsys.readouterr().err == (
        f"companion: {tmp_path} holds the folders of flights; name one of them, such as {newest}\n"
    )


@pytest.mark.parametrize("found", ["empty", "missing"])
def test_a_flight_without_its_record_is_no_success(tmp_path, found, capsys):
    """A full disk or a bad copy left `summary.json` alone; its page looked whole."""
    (tmp_path / "config.yaml").write_text("")
    if found == "empty":
        (tmp_path / RECORD_FILE).touch()
    told = f"{tmp_path / RECORD_FILE} is missing or empty: no sample and no event was recorded"
    for command in ("report", "export --csv", "compare"):
        out = [] if "export" in command else ["--out", str(tmp_path / "page.html")]
        assert main([*command.split(), str(tmp_path), *out]) == 1, command
        assert told in capsys.readouterr().out.splitlines()
        if out:
            assert f'<p class="bad">{told}</p>' in (tmp_path / "page.html").read_text("utf-8")


def test_a_folder_without_record_is_refused(tmp_path):
    with pytest.raises(RecordError, match=r"No such file .* is this the folder of a flight\?"):
        read_flight(tmp_path)


def test_a_folder_with_only_a_mavlink_log_is_answered_with_what_reads_the_log(tmp_path):
    (tmp_path / "2026.tlog").write_bytes(b"")
    with pytest.raises(RecordError, match=r"companion report .*2026\.tlog$"):
        read_flight(tmp_path)


def write_one(folder, topic, data):
    """A file with one message."""
    file = McapWriter(folder / "flight.mcap")
    file.metadata("flight", {"began_s": "1.0", "epoch_s": "0.0", "companion": "0.0.7"})
    file.message(topic, 1, data)
    file.close()
    return read_flight(folder)


def row(channel, number, code):
    numbers, codes = [number] * len(channel.numbers), [code] * len(channel.codes)
    return channel.packing.pack(cdr.CDR_HEADER, *numbers, *codes)


@pytest.mark.parametrize(
    ("topic", "data", "read"),
    [
        ("/phase", cdr.CDR_HEADER, lambda record: record.phases),
        ("/maneuver", bytes(300), lambda record: record.maneuvers),
        ("/alarm", b"", lambda record: record.alarms),
        ("/log", b"", lambda record: record.events),
        ("/sample", cdr.CDR_HEADER + bytes(3), lambda record: record.rows("sample")),
        ("/action", row(ACTION, 1.0, 200), lambda record: list(recorded_inputs(record))),
        ("/setpoint", row(SETPOINT, np.nan, 0), derived_summary),
        ("/resources", row(RESOURCES, np.nan, 0), summary_of),
    ],
)
def test_a_message_that_no_flight_records_is_an_error_with_the_place(tmp_path, topic, data, read):
    with pytest.raises(RecordError, match=r"flight\.mcap: not a valid record of a flight: "):
        read(write_one(tmp_path, topic, data))


@pytest.mark.parametrize("error", [MemoryError(), OverflowError("too large"), ZstdError("bad")])
def test_what_the_decompression_raises_is_damage(tmp_path, monkeypatch, error):
    def fails(*_, **__):
        raise error

    path = write(tmp_path)
    monkeypatch.setattr(reader, "breakup_chunk", fails)
    assert reader.read_mcap(path).damage == (str(error) or "MemoryError")


def test_other_columns_are_refused_with_the_channel_and_the_version(tmp_path, monkeypatch):
    def change(before, after):
        schemas = {
            topic: kind._replace(schema=kind.schema.replace(before, after))
            for topic, kind in TOPICS.items()
        }
        monkeypatch.setattr(writer, "TOPICS", schemas)

    change(b"# When", b"# At what time")
    assert write_one(tmp_path, "/action", row(ACTION, 1.0, 0)).rows("action")["time_s"] == 1.0
    change(b"uint8 ACTION_STOP_TURNING=8\n", b"")  # as before this action existed
    assert write_one(tmp_path, "/action", row(ACTION, 1.0, 0)).rows("action")["time_s"] == 1.0
    change(b"ACTION_FOLLOW=4", b"ACTION_FOLLOW=5")  # another meaning
    with pytest.raises(RecordError, match="of /action have other columns"):
        write_one(tmp_path, "/action", row(ACTION, 1.0, 0))
    change(b"float64 age_s", b"float64 age_ms")
    with pytest.raises(RecordError, match=r"of /sample have other columns .* companion 0\.0\.7"):
        write_one(tmp_path, "/action", row(ACTION, 1.0, 0))


@pytest.mark.parametrize("phase", ["takeoff", "offboard"])  # the second: taken over in the air
def test_a_killed_flight_says_since_when_it_flew(tmp_path, phase):
    writer = McapWriter(tmp_path / "flight.mcap")
    writer.metadata("flight", {"began_s": "1.0", "epoch_s": "0.0"})
    writer.message("/phase", 2_000_000_000, cdr.fields_message((2.0,), (phase, "the height")))
    for time, standing in ((1.5, 0), (2.5, 1), (3.0, 0), (9.0, 0)):
        codes = [standing if code.name == "standing" else 0 for code in INPUT.codes]
        data = INPUT.packing.pack(
            cdr.CDR_HEADER, time, *[np.nan] * (len(INPUT.numbers) - 1), *codes
        )
        writer.message(INPUT.topic, round(time * 1e9), data)
    writer.flush()
    writer.close(complete=False)
    derived = derived_summary(read_flight(tmp_path))
    assert derived["takeoff_s"] == 2.0
    assert derived["early_end"]["since_takeoff_s"] == 6.0


@pytest.mark.parametrize("found", ["{}", '{"result": "ok", "phases": []}', "[]", "{"])
def test_a_summary_without_its_keys_is_derived_from_the_record(tmp_path, found):
    write(tmp_path)
    (tmp_path / "summary.json").write_text(found)
    summary, provisional = summary_of(read_flight(tmp_path))
    assert provisional
    assert summary["setpoints"] == ROWS


def test_where_nobody_flies_a_reference_none_is_drawn():
    """The recorded one is then the vehicle's own position."""
    names = (*vector_names("reference", "m"), "offboard_active", "holds_position", "holds_height")
    guidance = np.ones(3, dtype=[(name, float) for name in names])
    guidance["offboard_active"][0] = guidance["holds_position"][1] = 0.0
    drawn = ~np.isnan(reference_positions(guidance))
    assert drawn.tolist() == [[False] * 3, [False, False, True], [True] * 3]


@pytest.mark.parametrize("command", ["plot", "report", "replay", "export --csv"])
def test_a_file_of_a_flight_is_answered_with_its_folder(tmp_path, command, capsys):
    (tmp_path / "flight.mcap").touch()
    assert main([*command.split(), str(tmp_path / "flight.mcap")]) == 2
    told = capsys.readouterr().err
    assert told.endswith(f"flight.mcap is a file; name the folder of the flight: {tmp_path}\n")


def test_only_a_missing_record_is_one_that_was_never_begun(tmp_path, monkeypatch, capsys):
    """One that may not be read is not empty, and an empty one is not replayed with success."""
    (tmp_path / "config.yaml").write_text("")
    assert read_flight(tmp_path).content.topic_order == []
    assert main(["replay", str(tmp_path)]) == 2
    assert "no attitude sample is recorded there" in " ".join(capsys.readouterr().err.split())

    def refused(_):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("companion.recording.flight_record.read_mcap", refused)
    with pytest.raises(RecordError, match=r"flight\.mcap: Permission denied"):
        read_flight(tmp_path)


def test_a_chunk_that_would_not_fit_into_memory_is_damage(tmp_path, monkeypatch):
    monkeypatch.setattr(reader, "_MAX_BYTES", 50)
    content = reader.read_mcap(write(tmp_path))
    assert not content.complete
    assert content.topic_order == []
    assert content.damage


def test_a_folder_of_a_flight_is_a_new_one_or_an_error(tmp_path, monkeypatch):
    first, second = flight_folder(tmp_path), flight_folder(tmp_path)
    assert first != second
    (tmp_path / "file").write_text("")
    with pytest.raises(ConfigError, match=r"recording\.directory: cannot make .*Not a directory"):
        flight_folder(tmp_path / "file")
    monkeypatch.setattr("companion.recording.folder.range", lambda *_: [1, 2], raising=False)

    class Still:
        @staticmethod
        def now(_):
            return datetime(2026, 1, 2, tzinfo=UTC)

    monkeypatch.setattr("companion.recording.folder.datetime", Still)
    assert flight_folder(tmp_path).name == "2026-01-02T00-00-00Z"
    assert flight_folder(tmp_path).name == "2026-01-02T00-00-00Z-2"
    with pytest.raises(ConfigError, match="98 more folders with the same time exist already"):
        flight_folder(tmp_path)


def test_a_folder_that_the_user_names_is_made_and_never_written_over(tmp_path):
    folder = tmp_path / "flights" / "mine"
    assert make_named_folder(folder) == make_named_folder(folder)
    (folder / TLOG_FILE).write_bytes(b"a flight")
    with pytest.raises(ConfigError, match=r"folder: .*mine holds a flight already; name another"):
        make_named_folder(folder)
    with pytest.raises(ConfigError, match=r"folder: cannot make .*Not a directory"):
        make_named_folder(folder / TLOG_FILE / "below")


def test_a_full_batch_is_sent_at_once_and_an_empty_one_never():
    sent = []
    batch = Batch(sent.append)
    batch.send()
    assert sent == []
    batch.add("/log", 1, bytes(_FULL_BATCH_BYTES))
    assert len(sent) == 1
    assert [len(data) for _, _, data in messages_of(sent[0])] == [_FULL_BATCH_BYTES]
    batch.send()
    assert len(sent) == 1


def test_a_full_disk_ends_the_record_but_a_bad_entry_does_not(tmp_path):
    def encode(value):
        def encoder(*_):
            if isinstance(value, Exception):
                raise value
            written.append(value)

        return encoder

    class Writer:
        def stream(self):
            written.append("streamed")

    written, told = [], []
    file = FlightRecorder(tmp_path / "flight.mcap", 0.0, lambda: 1.0, None, told.append)
    file._writer = Writer()
    bad = ValueError("no such row")
    file._write([(1.0, encode(1), ()), (2.0, encode(bad), ()), (3.0, encode(3), ())])
    assert written == [1, 3, "streamed"]
    assert file.dropped == 1
    assert "no such row" in told[0]
    with pytest.raises(OSError, match="No space"):
        file._write([(1.0, encode(OSError(28, "No space left on device")), ())])


def test_a_pipe_is_no_record_and_is_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / RECORD_FILE)
    with pytest.raises(RecordError, match=r"flight\.mcap: not a regular file; is this the folder"):
        read_flight(tmp_path)
