"""What hangs on the computer's date, and what does not: stamps on disk, stamps of the future."""

import asyncio
import json
import threading
import time
from datetime import UTC, datetime
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import common as dialect

from companion.mavlink.framing import FrameScanner, build_frame
from companion.mavlink.settings import LinkSettings
from companion.mavlink.signing import Signing, StampWriter
from companion.mavlink.stamp_file import StampFile
from companion.mavlink.stamps import EPOCH_UNIX_S, SignatureResult
from companion.vehicle.link import Link
from tests.mavlink.fakes import FakeVehicle, heartbeat, until

KEY = bytes(range(32))
NOW = datetime(2027, 1, 15, tzinfo=UTC).timestamp()
MINUTE, DAY = 60.0, 86400.0
YEAR = 365 * DAY
TIMESYNC = 111


@pytest.fixture(autouse=True)
def state(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    return tmp_path


def ticks(when):
    return round((when - EPOCH_UNIX_S) * 100_000)


def frame(when, message=None, link_id=3):
    """A frame of the vehicle that pymavlink signed at `when`, Unix time in s."""
    mav = dialect.MAVLink(None, 1, 1)
    mav.signing.secret_key, mav.signing.link_id = KEY, link_id
    mav.signing.timestamp, mav.signing.sign_outgoing = ticks(when), True
    [found] = FrameScanner().feed((message or heartbeat()).pack(mav))
    return found


def signing(clock=NOW, file=None, monotonic_clock=lambda: 0.0):
    return Signing(KEY, clock=lambda: clock, monotonic_clock=monotonic_clock, file=file)


def stamp_of(ours):
    """When our next frame is stamped, Unix time in s."""
    signed = ours.sign(build_frame(0, b"\1", sequence=0, system=1, component=1))
    return int.from_bytes(signed[-12:-6], "little") / 1e5 + EPOCH_UNIX_S


def run_once(clock, *frames):
    """A run of the program that ends well: its verdicts, and what it said."""
    file = StampFile(KEY)
    ours = signing(clock, file)
    keeper = StampWriter(ours, file)
    keeper.start()
    verdicts = [ours.check(one) for one in frames]
    keeper.stop()
    return verdicts, ours


def question(ours, ts1=123_456_789_000):
    """Our signed TIMESYNC question, whose answer repeats ts1."""
    payload = bytes(8) + ts1.to_bytes(8, "little")
    body = build_frame(TIMESYNC, payload, sequence=0, system=1, component=191, signed=True)
    ours.sign(body)
    return dialect.MAVLink_timesync_message(987_654_321, ts1)


# --- from one run to the next


def test_a_recording_of_the_last_minute_is_refused_after_a_restart():
    recorded = [frame(NOW - 30), frame(NOW - 10)]
    assert run_once(NOW, *recorded)[0] == [SignatureResult.GOOD] * 2
    verdicts, _ = run_once(NOW + 5, *recorded, frame(NOW + 4))
    assert verdicts == [SignatureResult.REPLAYED, SignatureResult.REPLAYED, SignatureResult.GOOD]


def test_with_the_clock_set_back_old_recordings_are_refused_and_our_stamps_go_on():
    _, ours = run_once(NOW, frame(NOW))
    last = stamp_of(ours)
    verdicts, ours = run_once(NOW - 90 * DAY, frame(NOW - 10 * DAY), frame(NOW + 5))
    assert verdicts == [SignatureResult.REPLAYED, SignatureResult.GOOD]
    assert stamp_of(ours) > last
    assert "clock is wrong: it says 2026-10-17" in ours.remarks[0]


def test_without_a_past_a_recording_is_not_taken_for_the_date():
    """The first run of all, the clock 90 days back: the recording is 80 days in its future."""
    ours = signing(NOW - 90 * DAY)
    assert ours.check(frame(NOW - 10 * DAY)) is SignatureResult.DATED_TOO_FAR_AHEAD
    [remark] = ours.remarks
    assert "dated 80 days ahead of this computer's date, and refused until" in remark


def test_a_vehicle_that_answers_is_the_better_clock():
    """No recording answers a question of this run."""
    ours = signing(NOW - 90 * DAY)
    old_answer = question(signing(NOW - 10 * DAY), ts1=55)
    assert ours.check(frame(NOW)) is SignatureResult.DATED_TOO_FAR_AHEAD
    assert stamp_of(ours) > NOW  # or the vehicle would not hear our question
    asked = question(ours)
    assert ours.check(frame(NOW - 10 * DAY, old_answer)) is SignatureResult.DATED_TOO_FAR_AHEAD
    not_an_answer = dialect.MAVLink_timesync_message(0, asked.ts1)
    assert ours.check(frame(NOW, not_an_answer)) is SignatureResult.DATED_TOO_FAR_AHEAD
    our_answer = build_frame(TIMESYNC, bytes([9] * 16), sequence=0, system=1, component=191)
    ours.sign(our_answer)
    repeats_it = dialect.MAVLink_timesync_message(1, int.from_bytes(bytes([9] * 8), "little"))
    assert ours.check(frame(NOW, repeats_it)) is SignatureResult.DATED_TOO_FAR_AHEAD
    assert ours.check(frame(NOW + 1, asked)) is SignatureResult.GOOD
    assert ours.check(frame(NOW + 2)) is SignatureResult.GOOD
    assert "90 days behind the vehicle, which has the right key and answers" in ours.remarks[-1]
    recording_of_another_link = frame(NOW - 10 * DAY, link_id=4)
    assert ours.check(recording_of_another_link) is SignatureResult.REPLAYED


def test_what_was_heard_with_a_wrong_clock_is_refused_after_the_next_start_too():
    file = StampFile(KEY)
    ours = signing(NOW - 90 * DAY, file)
    keeper = StampWriter(ours, file)
    keeper.start()
    heard = frame(NOW, question(ours))
    assert ours.check(heard) is SignatureResult.GOOD
    keeper.stop()
    for clock in (NOW - 90 * DAY, NOW):  # as wrong as before, and mended
        assert signing(clock, file).check(heard) is SignatureResult.REPLAYED
    assert signing(NOW, file).check(frame(NOW + 1)) is SignatureResult.GOOD


@pytest.mark.parametrize("years", [6, 10, 70])
def test_a_stamp_of_the_far_future_moves_nothing(years):
    verdicts, ours = run_once(NOW, frame(NOW + years * YEAR), frame(NOW))
    assert verdicts == [SignatureResult.DATED_TOO_FAR_AHEAD, SignatureResult.GOOD]
    assert stamp_of(ours) < NOW + 1
    assert f"dated {365 * years} days ahead of this computer's date, and refused" in ours.remarks[0]
    assert run_once(NOW + 1, frame(NOW + 1))[0] == [SignatureResult.GOOD]


def test_a_key_holder_ahead_does_not_silence_the_vehicle_even_if_it_answers():
    file = StampFile(KEY)
    ours = signing(NOW, file)
    keeper = StampWriter(ours, file)
    keeper.start()
    assert ours.check(frame(NOW + 90 * DAY, question(ours))) is SignatureResult.GOOD
    assert ours.check(frame(NOW + 1)) is SignatureResult.GOOD
    keeper.stop()
    assert signing(NOW + 5, file).check(frame(NOW + 6)) is SignatureResult.GOOD


def test_a_clock_before_this_program_was_made_does_not_count():
    ours = signing(0.0)
    assert "it says 1970-01-01 00:00 UTC, before this program was released" in ours.remarks[0]
    assert stamp_of(ours) == pytest.approx(datetime(2026, 9, 1, tzinfo=UTC).timestamp())
    assert time.time() > stamp_of(ours)  # else this release says a date that has not come yet


def test_a_clock_beyond_the_48_bits_of_a_stamp_breaks_nothing():
    ours = signing(datetime(2200, 1, 1, tzinfo=UTC).timestamp())
    assert stamp_of(ours) < datetime(2095, 1, 1, tzinfo=UTC).timestamp()
    assert ours.check(frame(NOW)) is SignatureResult.REPLAYED


def test_a_step_of_the_clock_in_flight_changes_nothing():
    clock = iter([NOW])  # read once
    now = [0.0]
    ours = Signing(KEY, clock=lambda: next(clock), monotonic_clock=lambda: now[0])
    for second in range(1, 4):
        now[0] = float(second)
        assert ours.check(frame(NOW + second)) is SignatureResult.GOOD
        assert stamp_of(ours) == pytest.approx(NOW + second, abs=0.01)


def test_a_vehicle_without_a_date_is_told_as_such():
    ours = signing()
    assert ours.check(frame(NOW - 100 * DAY)) is SignatureResult.REPLAYED
    assert "100 days before this computer's date" in ours.remarks[0]


# --- the file


def test_the_file_is_private_and_does_not_tell_the_key(state):
    run_once(NOW, frame(NOW))
    [path] = [path for path in state.rglob("*") if path.is_file()]
    assert path.stat().st_mode & 0o777 == 0o600
    assert path.parent.stat().st_mode & 0o077 == 0
    assert KEY.hex()[:8] not in path.name + path.read_text()
    assert json.loads(path.read_text())["streams"] == {"1/1/3": [ticks(NOW)]}


def test_after_a_kill_our_stamps_rise_and_nothing_heard_before_is_heard_again():
    """The file is ahead of the truth while a link is open, so no last write is needed."""
    file = StampFile(KEY)
    ours = signing(NOW, file)
    keeper = StampWriter(ours, file)
    keeper.start()
    heard = frame(NOW)
    ours.check(heard)
    wait_for(lambda: file.load()[0].streams)
    last = stamp_of(ours)
    killed_here = file.load()
    keeper.stop()
    file.save(killed_here[0])
    again = signing(NOW - 5.0, file)
    assert again.check(heard) is SignatureResult.REPLAYED
    assert stamp_of(again) > last
    assert again.check(frame(NOW + 16.0)) is SignatureResult.GOOD


def test_streams_of_another_vehicle_with_the_same_key_stay():
    run_once(NOW, frame(NOW, link_id=7))
    run_once(NOW + 1, frame(NOW + 1, link_id=8))
    assert set(StampFile(KEY).load()[0].streams) == {(1, 1, 7), (1, 1, 8)}


@pytest.mark.parametrize(
    "text",
    [
        b"",
        b"{}",
        b"\xff",
        b"[" * 100_000,
        b'{"date": 1e9, "sent": 0, "streams": {}}',
        b'{"date": 0, "sent": 9999999999999999, "streams": {}}',
        b'{"date": 0, "sent": 0, "streams": {"1/1": [3]}}',
    ],
    ids=lambda text: repr(text[-20:]),
)
def test_a_damaged_file_is_told_and_replaced(text):
    file = StampFile(KEY)
    file.path.parent.mkdir(parents=True)
    file.path.write_bytes(text)
    verdicts, ours = run_once(NOW, frame(NOW))
    assert verdicts == [SignatureResult.GOOD]
    [remark] = ours.remarks
    assert "cannot be read (it is damaged)" in remark
    assert file.load()[1] is None


async def test_a_disk_that_cannot_be_written_is_one_notice_and_no_failure(state):
    (state / "mavlink-companion").write_text("a file where a directory should be")

    notices = []
    file = StampFile(KEY)
    ours = Signing(KEY, file=file)
    settings = LinkSettings(endpoint="udpin://127.0.0.1:0", signing=ours)
    async with Link(settings, notice=notices.append) as link:
        vehicle = await FakeVehicle(link.local_address).open_udp()
        vehicle.mav.signing.secret_key = KEY
        vehicle.mav.signing.timestamp = ticks(time.time())
        vehicle.mav.signing.sign_outgoing = True
        vehicle.send(heartbeat())
        await link.wait_connected(5.0)
        vehicle.close()
    assert len(notices) == 1 or "cannot be read" in notices[0]
    assert sum("cannot be written to" in notice for notice in notices) == 1
    _, ours = run_once(NOW, frame(NOW))  # written twice at least, told once
    assert sum("cannot be written to" in remark for remark in ours.remarks) == 1


def test_the_directory_may_be_named_only_absolutely(monkeypatch, tmp_path):
    monkeypatch.setenv("HOME", str(tmp_path))
    for ignored in ("", "relative"):
        monkeypatch.setenv("XDG_STATE_HOME", ignored)
        assert StampFile(KEY).path.is_relative_to(Path(tmp_path, ".local", "state"))


# --- over a link


async def test_a_link_whose_clock_is_months_back_takes_the_vehicles_date_by_its_answer():
    """The vehicle as pymavlink judges: it refuses new streams older than a minute."""

    notices = []
    ours = Signing(KEY, clock=lambda: time.time() - 60 * DAY)
    settings = LinkSettings(endpoint="udpin://127.0.0.1:0", signing=ours)
    async with Link(settings, notice=notices.append) as link:
        vehicle = await FakeVehicle(link.local_address).open_udp()
        for side in (vehicle.mav, vehicle._parser):
            side.signing.secret_key, side.signing.link_id = KEY, 2
            side.signing.timestamp = ticks(time.time())
        vehicle.mav.signing.sign_outgoing = True
        vehicle.answers["TIMESYNC"] = lambda asked: (
            [] if asked.tc1 else [dialect.MAVLink_timesync_message(5_000_000, asked.ts1)]
        )

        def connected():
            vehicle.send(heartbeat())
            return link.state.heartbeat

        await until(connected)
        assert link.stats.peers == 0
        assert any("60 days behind the vehicle" in notice for notice in notices)
        vehicle.close()


def wait_for(condition):
    end = time.monotonic() + 5.0
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.001)


async def test_the_loop_never_waits_for_the_disk(monkeypatch):
    """A disk that hangs: the link opens, hears, and closes after the 2 s it is given."""
    monkeypatch.setattr("companion.mavlink.signing._LAST_WRITE_TIMEOUT_S", 0.05)
    answers = threading.Event()
    monkeypatch.setattr(StampFile, "save", lambda *_: answers.wait(10.0))

    began = time.monotonic()
    settings = LinkSettings("udpin://127.0.0.1:0", signing=Signing(KEY, file=StampFile(KEY)))
    async with Link(settings):
        await asyncio.sleep(0)
    assert time.monotonic() - began < 5.0
    answers.set()
