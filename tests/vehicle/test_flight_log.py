"""What is read from a `.tlog`: cut-outs of real autopilots' recordings, and logs written here."""

import struct
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from companion.identification import identify_vehicle
from companion.mavlink.errors import LogError
from companion.vehicle.flight_log import read_flight_log

RECORDINGS = Path(__file__).parents[1] / "mavlink" / "recordings"
PX4, ARDUPILOT = (12, 0x00060000), (3, 4)
VEHICLE, COMPANION = (1, 1), (1, 191)


class Log:
    """A `.tlog` as another program would write it."""

    def __init__(self):
        self.records = []

    def add(self, message, source=VEHICLE):
        packer = dialect.MAVLink(None, srcSystem=source[0], srcComponent=source[1])
        self.records.append(struct.pack(">Q", len(self.records)) + message.pack(packer))

    def heartbeat(self, family=PX4, *, armed=True, mode=None, source=VEHICLE):
        autopilot, obeys = family
        base, mode = 128 if armed else 0, obeys if mode is None else mode
        self.add(dialect.MAVLink_heartbeat_message(2, autopilot, base, mode, 4, 3), source)

    def attitude(self, ms, *rates, source=VEHICLE):
        rates = rates or (0.0, 0.0, 0.0)
        message = dialect.MAVLink_attitude_quaternion_message(ms, 1.0, 0.0, 0.0, 0.0, *rates)
        self.add(message, source)

    def setpoint(self, ms, roll=0.0, mask=128):
        message = dialect.MAVLink_set_attitude_target_message(
            ms, 1, 1, mask, (1.0, 0.0, 0.0, 0.0), roll, 0.2, 0.3, 0.5
        )
        self.add(message, COMPANION)

    def read(self, tmp_path, cut=None):
        path = tmp_path / "flight.tlog"
        path.write_bytes(b"".join(self.records)[:cut])
        return read_flight_log(path)


def flight(*, ours=True):
    """Ten samples, each answered by the setpoint k/10 rad/s; ours echo the sample's stamp."""
    log = Log()
    log.heartbeat()
    for k in range(10):
        log.attitude(1000 + 10 * k, 0.01 * k, 0.0, -0.5)
        log.setpoint(1000 + 10 * k if ours else 7 * k, 0.1 * k)
    log.heartbeat()
    return log


@pytest.mark.parametrize("ours", [True, False])
def test_setpoints_stand_at_the_sample_they_answer(tmp_path, ours):
    rows = flight(ours=ours).read(tmp_path)
    assert [row[0] for row in rows.setpoints] == pytest.approx([1.0 + 0.01 * k for k in range(10)])
    assert rows.setpoints[3][1:] == pytest.approx((0.3, 0.2, 0.3, 0.5))
    assert rows.rates[3] == pytest.approx((1.03, 0.03, 0.0, -0.5))


def test_an_echoed_stamp_counts_also_where_newer_samples_came_in_between(tmp_path):
    log = Log()
    log.heartbeat()
    for ms in (1000, 1010, 1020):
        log.attitude(ms)
    log.setpoint(1010)
    log.setpoint(0)
    log.heartbeat()
    assert [row[0] for row in log.read(tmp_path).setpoints] == [1.01, 1.02]


@pytest.mark.parametrize(
    "change", [{"armed": False}, {"mode": 0x03040000}], ids=["disarmed", "in hold"]
)
def test_only_what_the_vehicle_obeyed_counts(tmp_path, change):
    log = Log()
    log.heartbeat(**change)
    log.attitude(1000)
    log.setpoint(1000, 0.1)  # before it obeyed
    log.heartbeat()
    log.setpoint(1000, 0.2)
    log.heartbeat()
    log.setpoint(1000, 0.3)  # somewhere in here it stopped obeying
    log.heartbeat(**change)
    log.setpoint(1000, 0.4)
    log.heartbeat()
    log.setpoint(1000, 0.5)  # nobody tells whether it still obeyed
    assert [row[1] for row in log.read(tmp_path).setpoints] == pytest.approx([0.2])


def test_ardupilots_guided_obeys_too(tmp_path):
    log = Log()
    log.heartbeat(ARDUPILOT)
    log.attitude(1000)
    log.setpoint(1000)
    log.heartbeat(ARDUPILOT)
    assert len(log.read(tmp_path).setpoints) == 1


@pytest.mark.parametrize("mask", [0, 128 | 1, 128 | 2, 128 | 4, 128 | 64, 128 | 32, 7])
def test_a_setpoint_that_is_not_by_all_rates_and_thrust_does_not_count(tmp_path, mask):
    log = Log()
    log.heartbeat()
    log.attitude(1000)
    log.setpoint(1000, mask=mask)
    log.setpoint(1000, 0.7)
    log.heartbeat()
    assert [row[1] for row in log.read(tmp_path).setpoints] == pytest.approx([0.7])


def test_other_systems_and_components_are_not_the_vehicle(tmp_path):
    log = Log()
    log.add(dialect.MAVLink_heartbeat_message(18, 8, 128, 0x00060000, 4, 3), COMPANION)
    log.heartbeat()
    log.attitude(5000, source=(2, 1))
    log.attitude(1000)
    log.setpoint(0)
    log.heartbeat(armed=False, source=(2, 1))
    log.heartbeat()
    rows = log.read(tmp_path)
    assert [row[0] for row in rows.setpoints] == [1.0]
    assert [row[0] for row in rows.rates] == [1.0]


def test_the_accelerometer_tells_the_specific_thrust_in_the_vehicles_clock(tmp_path):
    log = flight()
    zeros = 9 * (0.0,)
    imu = dialect.MAVLink_highres_imu_message
    log.add(imu(1_050_000, 0.1, 0.2, -9.7, *zeros, 0.0, 0))
    log.add(imu(1_700_000_000_000_000, 0.1, 0.2, -9.7, *zeros, 0.0, 0))  # the time of day
    log.add(imu(2_200_000, 0.1, 0.2, -9.6, *zeros, 0.0, 0))  # booted a second before the other
    log.add(dialect.MAVLink_scaled_imu_message(1060, 0, 0, -1000, 0, 0, 0, 0, 0, 0))
    assert log.read(tmp_path).specific_thrust == [
        pytest.approx((1.05, 9.7)),
        pytest.approx((1.06, 9.80665)),
    ]


@pytest.mark.parametrize("begin", [900, 1000, 1010])
def test_of_two_tellings_of_the_rates_the_denser_counts(tmp_path, begin):
    log = flight()
    for ms in range(begin, begin + 100, 5):
        log.add(dialect.MAVLink_attitude_message(ms, 0.0, 0.0, 0.0, 0.9, 0.0, 0.0))
    rates = log.read(tmp_path).rates
    assert len(rates) == 20
    assert [row[1] for row in rates] == pytest.approx(20 * [0.9])


def test_a_log_that_breaks_off_is_read_to_its_last_whole_record(tmp_path):
    log = flight()
    log.attitude(1100)
    assert len(log.read(tmp_path, cut=-5).rates) == 10
    assert len(log.read(tmp_path).rates) == 11


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "is empty: its flight ended before"),
        (b"time,roll,pitch\n0.0,1.0,2.0\n", "not a .tlog"),
        (b"\0\0", "is empty: its flight ended before"),
    ],
    ids=["empty", "a table", "zeros"],
)
def test_what_is_not_a_tlog_is_refused(tmp_path, content, words):
    path = tmp_path / "flight.csv"
    path.write_bytes(content)
    with pytest.raises(LogError, match=words) as raised:
        read_flight_log(path)
    assert str(path) in str(raised.value)


def test_a_log_without_what_is_needed_says_what_is_missing(tmp_path):
    with pytest.raises(LogError, match="cannot read the log: No such file"):
        read_flight_log(tmp_path / "none.tlog")
    log = Log()
    log.attitude(1000)
    with pytest.raises(LogError, match=r"no heartbeat of PX4 \(12\) or ArduPilot \(3\)"):
        log.read(tmp_path)
    log.heartbeat()
    with pytest.raises(LogError, match="no body rates that the vehicle obeyed"):
        log.read(tmp_path)


def of_recording(name):
    rows = read_flight_log(RECORDINGS / name)
    return identify_vehicle(rows.setpoints, rows.rates, rows.specific_thrust)


def test_a_recording_of_px4_gives_what_was_measured_on_it():
    vehicle = of_recording("px4-rate-steps.tlog")
    for response in (vehicle.roll, vehicle.pitch):
        assert response.lag == pytest.approx(0.047, rel=0.15)
        # 100 Hz of telemetry: a setpoint answers a sample that is up to 10 ms old.
        assert response.dead_time == pytest.approx(0.040, abs=0.006)
        assert response.slew is None
        assert response.is_good()
    assert vehicle.thrust is None
    assert set(vehicle.flaws()) == {"yaw"}  # it was not turned
    assert "too little excitation" in vehicle.flaws()["yaw"]


def test_a_recording_of_ardupilot_gives_what_was_measured_on_it():
    vehicle = of_recording("ardupilot-rate-steps.tlog")
    for response in (vehicle.roll, vehicle.pitch):
        assert 0.015 <= response.lag <= 0.026
        assert 0.013 <= response.dead_time <= 0.021
        assert response.slew == pytest.approx(19.2, rel=0.25)  # 1100 °/s²
        assert response.is_good()
    assert set(vehicle.flaws()) == {"yaw"}


def damaged(log, number, change):
    """The bytes of a log whose record `number` is changed, and where that record begins."""
    records = [bytearray(record) for record in log.records]
    begin = sum(map(len, records[:number]))
    change(records[number])
    return b"".join(records), begin


def zeros(record):
    """What a card leaves that lost its power."""
    record[:] = bytes(len(record))


def other_length(record):
    record[9] = 250


def other_payload(record):
    record[20] ^= 0xFF


def junk(record):
    """As MAVProxy records bytes of the radio that are no frame."""
    record[8:] = b"\xfd garbage \xfe of the radio \xfd\xfe"


def gone(record):
    record.clear()
    record += b"\x00\x01"


@pytest.mark.parametrize("change", [zeros, other_length, other_payload, junk, gone])
@pytest.mark.parametrize("number", [0, 9, 10])
def test_a_damaged_record_is_skipped_and_told(tmp_path, change, number):
    log = flight()
    if number == 0:
        log.records.insert(0, log.records[0])  # else no attitude counts before the next heartbeat
    data, begin = damaged(log, number, change)
    path = tmp_path / "flight.tlog"
    path.write_bytes(data)
    rows = read_flight_log(path)
    lost_setpoint, lost_sample = number == 10, number == 9
    assert len(rows.setpoints) == 10 - lost_setpoint
    assert len(rows.rates) == 10 - lost_sample
    assert "damaged at 1 place, the first after" in rows.damage
    assert begin <= int(rows.damage.split("first after ")[1].split(" ")[0]) <= begin + 8


def test_an_intact_log_and_one_that_is_cut_off_are_not_damaged(tmp_path):
    log = flight()
    assert log.read(tmp_path).damage is None
    log.heartbeat()
    for cut in range(-1, -len(log.records[-1]), -1):
        assert log.read(tmp_path, cut).damage is None


def test_frames_of_other_dialects_are_no_damage(tmp_path):
    """An unknown number, and a known one whose definition is another, so that its CRC differs."""
    log = flight()
    frame = bytearray(log.records[-1])
    for number in (60_000, dialect.MAVLINK_MSG_ID_EKF_STATUS_REPORT):
        frame[15:18] = number.to_bytes(3, "little")
        log.records.insert(-1, bytes(frame))
    rows = log.read(tmp_path)
    assert (rows.damage, len(rows.setpoints)) == (None, 10)


@pytest.mark.parametrize(
    ("begin", "words"),
    [
        (b"ULog\x01\x12\x35\x01", "this is a ULog; give the .tlog"),
        (b"\xa3\x95\x80\x80\x59FMT", "this is a DataFlash log; give the .tlog"),
        (b"PK", "not a .tlog; expected MAVLink frames, each after 8 bytes"),
    ],
    ids=["ULog", "DataFlash", "zip"],
)
def test_other_files_are_refused(tmp_path, begin, words):
    path = tmp_path / "given"
    path.write_bytes(begin + bytes(1000))
    with pytest.raises(LogError, match=words):
        read_flight_log(path)
