"""A replay gives the commands of the flight to the bit; others read the files of a flight, too."""

import csv
import json
import shutil
import subprocess
import sys
from functools import cache
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from pymavlink import mavutil

from companion.attitude import BodyRates
from companion.cli.main import main
from companion.config.files import changed, load
from companion.config.known_drag import prior_of
from companion.drag import Drag
from companion.files.yaml_file import ConfigError
from companion.guidance.drag_estimate import ANY_VEHICLE
from companion.recording.flight_record import RecordError, read_flight
from companion.recording.learned_file import LearnedFile
from companion.recording.mcap_file.channels import TOPICS
from companion.recording.mcap_file.flight_events import ValuesChange
from companion.recording.measurements.recorded_summary import derived_summary, summary_of
from companion.replay.recorded import RecordedAction, Setpoint
from companion.replay.replay import Replay, ReplayedSample
from companion.replay.report import result_lines
from tests.flight.fly import fly, mock_vehicle

FLIGHTS = {
    "steps": {
        "flight": {"maneuvers": ["hover", "steps"]},
        "steps": {"duration_s": 0.4, "settle_s": 0.5},
    },
    "circle": {"flight": {"maneuvers": ["circle"]}},
    "exact": {"flight": {"maneuvers": ["corners"]}, "planner": {"name": "exact"}},
    "doublets": {"flight": {"maneuvers": ["identify"]}, "planner": {"name": "first-order"}},
}
GUSTS = {"speed_m_s": 2.0, "gust_m_s": 1.0}
FAULTS = [
    {"kind": "stop_telemetry", "after_offboard_s": 3.0, "duration_s": 0.11},
    {"kind": "estimator_reset", "after_offboard_s": 3.5, "yaw_deg": 8.0},
    {"kind": "delay", "delay_ms": 60, "after_offboard_s": 4.0, "duration_s": 0.3},
    {"kind": "reorder", "probability": 0.2, "after_offboard_s": 4.5, "duration_s": 1.0},
    {"kind": "drop", "probability": 0.2, "after_offboard_s": 5.5, "duration_s": 0.5},
    {"kind": "estimator_reset", "after_offboard_s": 6.5, "position_ned_m": [0.5, 0.0, 0.0]},
]


def flown(folder, autopilot="px4", flight="steps", **mock):
    with mock_vehicle(autopilot=autopilot, seed=5, **mock) as vehicle:
        return fly(vehicle, folder, hover={"duration_s": 1.0}, **FLIGHTS[flight])


@pytest.fixture(scope="module")
def steps(tmp_path_factory):
    """A flight of steps by autopilot: its folder and its summary. The files stay as they are."""

    @cache
    def flight_of(autopilot):
        folder = tmp_path_factory.mktemp(autopilot)
        return folder, flown(folder, autopilot)

    return flight_of


def replayed(folder, **changes):
    config = changed(load(folder / "config.yaml"), changes, "test")
    return Replay(read_flight(folder), config).run()


SLOW = pytest.mark.slow
LOCKSTEP = {"in_lockstep": True, "wind": GUSTS}


@pytest.mark.parametrize(
    ("autopilot", "flight", "mock"),
    [
        ("px4", "circle", LOCKSTEP),
        pytest.param("ardupilot", "circle", LOCKSTEP, marks=SLOW),
        pytest.param("px4", "exact", {"wind": GUSTS}, marks=SLOW),
        pytest.param("ardupilot", "exact", {"wind": GUSTS}, marks=SLOW),
        pytest.param("px4", "doublets", {}, marks=SLOW),
        pytest.param("ardupilot", "doublets", {}, marks=SLOW),
    ],
)
def test_a_replay_gives_the_commands_of_the_flight_to_the_bit(tmp_path, autopilot, flight, mock):
    replays_to_the_bit(tmp_path, flown(tmp_path, autopilot, flight, **mock))


def test_so_does_a_replay_of_steps(steps):
    replays_to_the_bit(*steps("ardupilot"))


def test_so_does_a_replay_of_a_record_that_ends_between_a_sample_and_its_setpoint(steps):
    folder, _ = steps("ardupilot")
    record = read_flight(folder)
    order = record.content.topic_order
    del order[len(order) - 1 - order[::-1].index("/setpoint") :]
    assert order[-1] == "/sample"
    samples = Replay(record, load(folder / "config.yaml")).run()
    assert [each for each in samples if not each.is_same] == []
    assert len(samples) == order.count("/sample") - 1


def replays_to_the_bit(folder, summary):
    assert summary.result == "ok", summary.events
    samples = replayed(folder)
    assert [each for each in samples if not each.is_same] == []
    assert (
        sum(each.recorded_setpoint is not None for each in samples)
        == summary.counts.setpoints
        > 1000
    )


MODES = {"px4": "OFFBOARD", "ardupilot": "GUIDED"}
_GRAPHS = ("degrees(SET_ATTITUDE_TARGET.body_roll_rate)", "LOCAL_POSITION_NED.z*-1")
_GRAPHER = """
import json, sys
import matplotlib
matplotlib.use("Agg")
from MAVProxy.modules.lib.grapher import MavGraph
from pymavlink import mavutil

def graphed(path, expressions):
    log = mavutil.mavlink_connection(path, notimestamps=False, zero_time_base=False)
    modes = log.flightmode_list()
    graph = MavGraph()
    graph.add_mav(log)
    for expression in expressions:
        graph.add_field(expression)
    graph.process([], modes, 0)
    return {"modes": [mode for mode, *_ in modes], "curves": graph.y}

print(json.dumps([graphed(path, sys.argv[3:]) for path in sys.argv[1:3]]))
"""
"""What MAVExplorer does when it loads a log and draws graphs, without its windows (wxPython)."""


@pytest.fixture(scope="module")
def graphs(steps):
    """What it draws of the flight by autopilot; its imports cost more than that."""
    logs = {autopilot: steps(autopilot)[0] / "flight.tlog" for autopilot in MODES}
    command = [sys.executable, "-c", _GRAPHER, *logs.values(), *_GRAPHS]
    said = subprocess.check_output(command, text=True).splitlines()[-1]
    return dict(zip(logs, json.loads(said), strict=True))


@pytest.mark.parametrize("autopilot", MODES)
def test_mavexplorer_and_mavlogdump_read_the_log(steps, graphs, autopilot):
    folder, summary = steps(autopilot)
    tlog, python = folder / "flight.tlog", sys.executable
    assert MODES[autopilot] in graphs[autopilot]["modes"]
    rates, heights = graphs[autopilot]["curves"]
    assert len(rates) == summary.counts.setpoints
    assert 10.0 < max(rates) < 180.0
    assert max(heights) == pytest.approx(2.0, abs=0.4)

    mavlogdump = Path(python).with_name("mavlogdump.py")
    command = [python, mavlogdump, "--types", "SET_ATTITUDE_TARGET", "--format", "json", tlog]
    dumped = subprocess.check_output(command, text=True).splitlines()
    thrust = [json.loads(line)["data"]["thrust"] for line in dumped]
    assert thrust == pytest.approx(read_flight(folder).rows("setpoint")["thrust"], abs=1e-6)


def test_a_replay_of_a_flight_with_faults_is_that_flight_too(tmp_path):
    long = {"hover": {"duration_s": 8.0}, "flight": {"maneuvers": ["hover"]}}
    with mock_vehicle(seed=5, faults=FAULTS, wind=GUSTS) as vehicle:
        summary = fly(vehicle, tmp_path, **long)
    samples = replayed(tmp_path)
    assert [each for each in samples if not each.is_same] == []
    reasons = {each.recorded_reason for each in samples}
    assert {"answered", "not_newer", "awaiting_mode"} <= reasons, summary.events
    with_recorded_commands = Replay(
        read_flight(tmp_path), changed(load(tmp_path / "config.yaml"), {}, "test")
    )
    with_recorded_commands.follows_record = True
    assert all(each.is_same for each in with_recorded_commands.run())


@pytest.fixture(scope="module")
def good(steps):
    """A flight with steps, its folder and its summary."""
    folder, summary = steps("px4")
    return folder, summary.as_dict()


def test_other_readers_read_the_files(good):
    folder, summary = good
    with (folder / "flight.mcap").open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()], validate_crcs=True)
        counts, schemas = {}, {}
        for schema, channel, _, message in reader.iter_decoded_messages():
            counts[channel.topic] = counts.get(channel.topic, 0) + 1
            schemas[channel.topic] = schema.name
            newest = message
        metadata = {each.name: each.metadata for each in reader.iter_metadata()}
    assert newest is not None
    elsewhere = {"/attitude_target", "/alarm", "/change"}  # nothing of these in this flight
    assert set(counts) == TOPICS.keys() - elsewhere
    assert schemas["/tf"] == "foxglove_msgs/msg/FrameTransform"
    assert counts["/setpoint"] == summary["setpoints"]
    assert metadata["flight"]["plan"] == "configuration"
    assert metadata["configuration"]["planner.gain_per_s"] == "5.0"

    log = mavutil.mavlink_connection(str(folder / "flight.tlog"))
    sent = iter(lambda: log.recv_match(type="SET_ATTITUDE_TARGET"), None)
    rows = read_flight(folder).rows("setpoint")
    wire = np.array(
        [(m.body_roll_rate, m.body_pitch_rate, m.body_yaw_rate, m.thrust) for m in sent]
    )
    columns = ["commanded_roll_rad_s", "commanded_pitch_rad_s", "commanded_yaw_rad_s", "thrust"]
    ours = np.column_stack([rows[name] for name in columns])
    np.testing.assert_array_equal(ours.astype(np.float32), wire.astype(np.float32))


def test_the_record_alone_gives_the_figures_of_the_summary(good):
    folder, summary = good
    record = read_flight(folder)
    derived = derived_summary(record)
    assert summary_of(record) == (json.loads((folder / "summary.json").read_text()), False)
    for key in ("samples", "setpoints", "unanswered", "response", "tracking", "maneuvers"):
        assert derived[key] == summary[key], key
    for key in ("extent", "latency_us", "phases", "planner", "gain_per_s", "lockstep"):
        assert derived[key] == summary[key], key
    assert derived["takeoff_s"] == pytest.approx(summary["takeoff_s"], abs=0.15)
    since = derived["early_end"]["time_s"] - derived["takeoff_s"]
    assert derived["early_end"]["since_takeoff_s"] == pytest.approx(since, abs=0.002)
    assert "before it was over" in derived["result"]


def test_the_command_tells_what_is_the_same_and_what_differs(good, tmp_path, capsys):
    folder, summary = good
    assert main(["replay", str(folder)]) == 0
    assert f"identical: all {summary['setpoints']} setpoints are equal" in capsys.readouterr().out
    table = tmp_path / "both.csv"
    changes = ["--set", "planner.gain_per_s=4", "--csv", str(table)]
    assert main(["replay", str(folder), *changes]) == 0
    said = capsys.readouterr().out
    assert "setpoints differ, at most by: roll " in said
    rows = list(csv.DictReader(table.open()))
    assert len(rows) == len(read_flight(folder).rows("sample"))
    assert any(row["recorded_roll_rad_s"] != row["replayed_roll_rad_s"] for row in rows)


def test_a_table_that_cannot_be_written_is_told_before_the_replay(good, tmp_path, capsys):
    for csv_file, why in ((tmp_path / "no" / "x", "there is no folder"), (tmp_path, "a folder")):
        assert main(["replay", str(good[0]), "--csv", str(csv_file)]) == 2
        told = capsys.readouterr()
        assert (told.out, why in told.err) == ("", True)


def test_a_damaged_recording_is_told_and_its_replay_is_no_success(good, tmp_path, capsys):
    folder = tmp_path / "damaged"
    shutil.copytree(good[0], folder)
    recording = folder / "flight.mcap"
    data = bytearray(recording.read_bytes())
    with recording.open("rb") as stream:
        chunks = make_reader(stream).get_summary().chunk_indexes
    chunk = chunks[
        len(chunks) // 2
    ]  # between chunks are only indexes, which a replay does not need
    middle = chunk.chunk_start_offset + chunk.chunk_length // 2
    data[middle : middle + 5000] = bytes(range(250)) * 20
    recording.write_bytes(data)
    assert main(["replay", str(folder)]) == 1
    assert "the recording is damaged, and only the part before" in capsys.readouterr().out
    assert main(["export", str(folder), "--csv"]) == 1


def test_a_flight_is_exported_as_csv_and_parquet(good, tmp_path, capsys):
    folder, _ = good
    parquet = pytest.importorskip("pyarrow.parquet")
    for kind in ("csv", "parquet"):
        assert main(["export", str(folder), f"--{kind}", "--into", str(tmp_path)]) == 0
    rows = read_flight(folder).rows("guidance")
    told = capsys.readouterr().out
    assert str(tmp_path / "tracking.csv") in told
    assert f"{tmp_path / 'guidance.csv'}  {len(rows):,} rows" in told
    for name in ("estimated_north_m", "time_s"):
        csv_column = np.genfromtxt(tmp_path / "guidance.csv", delimiter=",", names=True)[name]
        np.testing.assert_array_equal(csv_column, rows[name])
        column = parquet.read_table(tmp_path / "guidance.parquet")[name].to_numpy()
        np.testing.assert_array_equal(column, rows[name])


def test_a_missing_extra_and_a_wrong_folder_are_one_sentence(good, tmp_path, capsys, monkeypatch):
    folder, _ = good
    assert main(["replay", str(tmp_path)]) == 2
    assert "is this the folder of a flight?" in capsys.readouterr().err
    monkeypatch.setattr("importlib.util.find_spec", lambda *_: None)
    assert main(["export", str(folder), "--parquet", "--into", str(tmp_path)]) == 2
    assert "exporting Parquet needs pyarrow" in capsys.readouterr().err


def test_a_place_that_cannot_be_written_is_named(good, tmp_path, capsys, monkeypatch):
    folder, _ = good
    file = tmp_path / "file"
    file.write_text("")
    below = file / "below"
    for command in (
        ["replay", str(folder), "--csv", str(below)],
        ["export", str(folder), "--csv", "--into", str(below)],
        ["plot", str(folder), "--out", str(below / "a.png")],
        ["report", str(folder), "--out", str(below)],
    ):
        assert main(command) == 2
        told = capsys.readouterr().err
        assert told.startswith(f"companion: {below}")
        assert ("there is no folder" if command[0] == "replay" else "Not a directory") in told
    monkeypatch.setattr(Replay, "run", lambda _: [])
    assert main(["replay", str(folder)]) == 2
    assert "no attitude sample is recorded there to replay" in capsys.readouterr().err


def test_answers_that_only_one_of_both_gave_are_told_by_their_reasons():
    sent = Setpoint(BodyRates(0.1, 0.0, 0.0), 0.5)
    samples = [
        ReplayedSample(2.0, 2.0, sent, None, "answered", "not_in_control"),
        ReplayedSample(3.0, 3.0, None, None, "stale", "stale"),
    ]
    assert result_lines(samples, 1.5, follows_record=False) == [
        "The answers to 1 of 2 samples differ from those in the flight, the first 0.50 s after the "
        "flight began.",
        "1 samples: answered in the flight, not in control in the replay.",
    ]
    same = result_lines(samples[1:], 1.5, follows_record=True)
    assert same[0].startswith("Only the control loop is replayed, with the recorded commands")
    assert same[1] == (
        "identical: all 0 setpoints are equal to the bit, and all 1 unanswered samples have the "
        "same reasons"
    )


class Loops:
    """Stands for the loops of a replay, and notes what they are asked to do."""

    def __init__(self):
        self.asked = []
        self.command, self.offboard_active = None, False
        self.estimate = SimpleNamespace(drag=self)

    def __getattr__(self, name):
        def asked(*told):
            self.asked.append((name, *told))

        return asked


@pytest.mark.parametrize(
    ("name", "drag", "asked"),
    [
        ("drop_command", None, "drop_command"),
        ("restart_planner", None, "restart_planner"),
        ("stand_by", None, "stand_by"),
        ("hold_here", None, "hold_here"),
        ("hold_reference", None, "hold_reference"),
        ("follow", None, "follow"),
        ("give_up", None, "give_up"),
        ("move_upwind", None, "move_upwind"),
        ("drag_prior", Drag(0.2, 0.1), "begin"),
        ("drag_prior", None, "begin"),
    ],
)
def test_each_action_of_the_record_is_repeated(good, name, drag, asked):
    folder, _ = good
    made = Replay(read_flight(folder), load(folder / "config.yaml"))
    made._loop = made._guidance = loops = Loops()
    made._replay_action(RecordedAction(5.0, name, 0.25, drag))
    ((found, *told),) = loops.asked
    assert found == asked
    if asked == "begin":
        assert told == [ANY_VEHICLE if drag is None else prior_of(drag)]
    assert made._vehicle.offset == 0.25


def test_a_change_of_values_is_replayed_as_it_was_made(good):
    folder, _ = good
    slower = {"planner": {"gain_per_s": 4.0}}
    made = Replay(read_flight(folder), load(folder / "config.yaml"))
    made._slew = slew = Loops()
    made._replay_change(ValuesChange(7.0, False, slower))
    (begun,) = slew.asked
    assert (begun[0], begun[1].planner.gain_per_s, begun[2]) == ("begin", 4.0, 7.0)
    made._replay_change(ValuesChange(8.0, True, slower))
    assert slew.asked[1][0] == "jump"
    fixed = changed(load(folder / "config.yaml"), {"guidance": {"kind": "nmpc"}}, "a test")
    made = Replay(read_flight(folder), fixed)
    made._slew = slew = Loops()
    made._replay_change(ValuesChange(7.0, False, slower))
    assert slew.asked == []


def test_maneuvers_are_made_with_the_drag_of_that_time_not_with_what_was_learned_since(
    good, tmp_path
):
    folder, _ = good
    circle = {
        "flight": {"maneuvers": ["circle"]},
        "circle": {"radius_m": 5.0, "speed_m_s": 5.0},
        "limits": {"max_tilt_deg": 34.0},
        "guidance": {"drag_per_s": None},
        "recording": {"directory": str(tmp_path)},
    }
    LearnedFile(tmp_path, "aa").save(Drag(1.2), 5.0)  # the circle would not fit the limits
    config = changed(load(folder / "config.yaml"), circle, "a test")
    record = read_flight(folder)
    flight = record.metadata["flight"]
    with pytest.raises(ConfigError, match=r"needs 3[56].*tilt"):
        Replay(record, config)  # the flight was configured with 1.0 1/s
    flight["assumed_drag_per_s"] = "0.7"
    Replay(record, config)
    flight["assumed_drag_per_s"] = "much"
    with pytest.raises(RecordError, match="not a valid record of a flight"):
        Replay(record, config)
