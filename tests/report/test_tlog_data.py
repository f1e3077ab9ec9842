"""What the page takes from a `.tlog` of any program, message by message."""

import struct

import numpy as np
import pytest
from pymavlink.dialects.v20 import common as dialect

from companion.config import Config
from companion.mavlink.errors import LogError
from companion.report.early_end import early_end
from companion.report.flight_data import FlightData, Span
from companion.report.plots import time_axis
from companion.report.tables import events_at_end, extremes_text
from companion.report.timeline import timeline
from companion.report.tlog_data import logged_flight

PX4, POSCTL, OFFBOARD = 12, 3 << 16, 6 << 16


def written(path, *messages, system=1):
    """A `.tlog` of these messages; one in a tuple comes from its own (system, component)."""
    packers = {}
    with path.open("wb") as file:
        for number, each in enumerate(messages):
            message, source = each if isinstance(each, tuple) else (each, (system, 1))
            packer = packers.setdefault(source, dialect.MAVLink(None, *source))
            file.write(struct.pack(">Q", 1_000_000 + number) + message.pack(packer))
            packer.seq = (packer.seq + 1) & 0xFF
    return path


def heartbeat(mode=POSCTL, autopilot=PX4):
    return dialect.MAVLink_heartbeat_message(2, autopilot, 1 | 128, mode, 3, 3)


def euler(ms, roll=0.0, pitch=0.0):
    return dialect.MAVLink_attitude_message(ms, roll, pitch, 0.0, 0.0, 0.0, 0.0)


def quaternion(ms, *q):
    return dialect.MAVLink_attitude_quaternion_message(ms, *q, 0.0, 0.0, 0.0)


def position(ms, height=2.0, velocity=(3.0, 4.0, 0.0)):
    return dialect.MAVLink_local_position_ned_message(ms, 1.0, 2.0, -height, *velocity)


def text(severity, words):
    return dialect.MAVLink_statustext_message(severity, words.encode())


def test_a_log_without_setpoints_shows_motion_modes_and_the_autopilots_words(tmp_path):
    path = written(
        tmp_path / "a.tlog",
        heartbeat(),
        euler(1000, roll=0.3, pitch=0.4),
        position(2000),
        (position(2500, height=99.0), (7, 1)),
        text(2, "critical"),
        text(4, "warning"),
        text(6, "info"),
        heartbeat(OFFBOARD),
        heartbeat(OFFBOARD),
        (heartbeat(autopilot=8), (255, 190)),
        (heartbeat(POSCTL), (7, 1)),
        position(4000, height=5.0, velocity=(0.0, 0.0, 0.0)),
    )
    flight = logged_flight(path)
    assert set(flight.curves) == {"position", "motion"}
    assert flight.curves["motion"].time.tolist() == [1.0, 3.0]
    tilt = np.degrees(np.arccos(np.cos(0.3) * np.cos(0.4)))
    assert flight.curves["motion"].values == pytest.approx(
        np.array([[2.0, 5.0, tilt], [5.0, 0.0, tilt]])
    )
    assert [(mode.begin, mode.end) for mode in flight.modes] == [(0.0, 1.0), (1.0, 3.0)]
    assert [(event.time, event.text) for event in flight.events] == [
        (1.0, "critical"),
        (1.0, "warning"),
        (1.0, "info"),
    ]
    levels = [event.level for event in flight.events]
    assert levels[0] > levels[1] > levels[2]
    assert extremes_text(flight) == "3 s, up to 5.0 m high, 5.0 m/s fast, 28° tilted"


def test_a_quaternion_that_is_none_is_left_out(tmp_path):
    half = np.sqrt(0.5)
    path = written(
        tmp_path / "a.tlog",
        heartbeat(),
        quaternion(0, 1.0, 0.0, 0.0, 0.0),
        quaternion(500, 0.0, 0.0, 0.0, 0.0),
        quaternion(1000, np.nan, 0.0, 0.0, 0.0),
        quaternion(2000, half, half, 0.0, 0.0),
    )
    flight = logged_flight(path)
    coefficients = flight.curves["coefficients"]
    assert coefficients.time.tolist() == [0.0, 2.0]
    assert coefficients.values == pytest.approx(np.array([[0.0, 0.0], [0.0, 1.0]]), abs=1e-6)


def test_a_vehicle_on_its_back_is_tilted_by_more_than_90_degrees(tmp_path):
    half = np.radians(150.0) / 2.0
    rolled = quaternion(1000, np.cos(half), np.sin(half), 0.0, 0.0)
    flight = logged_flight(written(tmp_path / "a.tlog", heartbeat(), rolled, position(1000)))
    assert flight.curves["motion"].values[0, 2] == pytest.approx(150.0, abs=1e-3)


def test_without_an_attitude_the_tilt_is_unknown(tmp_path):
    flight = logged_flight(
        written(tmp_path / "a.tlog", heartbeat(), position(1000), position(2000))
    )
    assert np.isnan(flight.curves["motion"].values[:, 2]).all()
    assert extremes_text(flight) == "1 s, up to 2.0 m high, 5.0 m/s fast"


@pytest.mark.parametrize(
    "messages",
    [
        (heartbeat(),),
        (position(1000),),
        (heartbeat(autopilot=8), position(1000)),
        (text(4, "words"),),
    ],
)
def test_a_log_without_telemetry_of_an_autopilot_is_refused(tmp_path, messages):
    with pytest.raises(LogError, match=r"a\.tlog: has no telemetry of PX4 or ArduPilot"):
        logged_flight(written(tmp_path / "a.tlog", *messages))


def test_a_flight_without_phases_has_no_timeline_and_no_extremes():
    empty = FlightData("a flight", {})
    assert list(timeline(empty)) == []
    assert extremes_text(empty) == ""
    assert events_at_end(empty) == []


class Record:
    """The guidance and motion of a flight that was under our control from 1 s on, or never."""

    def __init__(self, *, controlled):
        kinds = [(name, float) for name in ("time_s", "estimated_north_m", "estimated_east_m")]
        rows = [(0.0, 9.0, 9.0, 0), (1.0, 3.0, 4.0, int(controlled)), (2.0, 5.0, 6.0, 0)]
        self._guidance = np.array(rows, dtype=[*kinds, ("offboard_active", int)])
        self._motion = np.array(
            [(0.0, 0.0), (1.0, 2.5), (2.0, 4.0)], dtype=[("time_s", float), ("height_m", float)]
        )

    def rows(self, name):
        return {"guidance": self._guidance, "motion": self._motion}[name]

    def since_start(self, times):
        return times


def fence(reason, *, controlled=True, **safety):
    config = Config.model_validate({"limits": {"fence_ceiling_m": 10.0}, "safety": safety})
    told = {"early_end": {"time_s": 2.0, "monitor": "fence"}, "result": reason}
    return early_end(told, Record(controlled=controlled), config).limit


def test_the_fence_lies_around_the_place_where_control_began():
    assert fence("40 m up, above limits.fence_ceiling_m").levels == (12.5,)
    polygon = {"fence_polygon_m": ((0.0, 0.0), (0.0, 5.0), (5.0, 0.0))}
    drawn = fence("outside the polygon", **polygon)
    assert drawn.outline == ((3.0, 4.0), (3.0, 9.0), (8.0, 4.0), (3.0, 4.0))


def test_a_fence_that_no_plot_shows_is_no_limit():
    assert fence("outside the polygon") is None  # it is given in degrees
    assert fence("40 m up, above limits.fence_ceiling_m", controlled=False) is None


def test_a_time_axis_covers_the_longest_flight():
    long, short = (FlightData("a", {}, phases=(Span(0.0, end, "hover"),)) for end in (9.0, 5.0))
    empty = FlightData("b", {})
    assert time_axis([short, long, empty])["xaxis"]["range"] == [0.0, 9.0]
    assert "range" not in time_axis([empty])["xaxis"]


def test_a_damaged_record_is_a_fault_of_the_page(tmp_path):
    path = written(tmp_path / "a.tlog", heartbeat(), *(position(1000 * k) for k in range(1, 6)))
    assert logged_flight(path).fault is None
    data = bytearray(path.read_bytes())
    fourth = data.index((4000).to_bytes(4, "little"))
    data[fourth] ^= 0xFF
    path.write_bytes(data)
    flight = logged_flight(path)
    assert flight.fault is not None
    assert f"{path}: damaged at 1 place" in flight.fault
    assert flight.curves["position"].time.tolist() == [0.0, 1.0, 2.0, 4.0]
