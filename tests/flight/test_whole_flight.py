"""The whole maneuver against the mock."""

import pytest
from pymavlink import mavutil

from companion.control.loop_record import UnansweredReason
from tests.flight.fly import fly, mock_vehicle

HOVER = {"hover": {"duration_s": 1.0}}
MANEUVERS = {
    "flight": {"maneuvers": ["hover", "steps", "circle"]},
    "steps": {"duration_s": 0.8, "settle_s": 1.0},
    "circle": {"radius_m": 1.0},
    **HOVER,
}


@pytest.fixture(scope="module")
def twice(tmp_path_factory):
    """The same maneuver flown twice by two fresh vehicles."""
    summaries = []
    for number in range(2):
        folder = tmp_path_factory.mktemp(f"flight{number}")
        with mock_vehicle(folder, full_rate=True, seed=7, in_lockstep=True) as mock:
            summaries.append(fly(mock, folder / "log", **MANEUVERS))
            assert not mock.state()["crashed"]
    return summaries


def test_it_flies_lands_and_disarms(twice):
    summary = twice[0]
    assert summary.result == "ok", summary.events
    assert summary.phase == "disarm"
    assert summary.events[-1][1] == "disarmed"
    assert summary.counts.setpoints == summary.counts.samples > 4000
    assert summary.counts.rate_hz == pytest.approx(250.0, abs=1.0)
    assert summary.as_dict()["unanswered"] == {reason.value: 0 for reason in UnansweredReason}


def test_the_response_is_what_the_rate_loop_allows(twice):
    """p = 5 through the measured PX4 rate response: 0.26 s, straight within 1 %."""
    response = twice[0].response()
    assert response.time_constant_north_s == pytest.approx(0.26, abs=0.02)
    assert response.time_constant_east_s == pytest.approx(0.26, abs=0.02)
    assert response.cross_axis_max < 0.01
    tracking = twice[0].tracking()
    assert tracking["position_rms_m"] < 0.5
    assert tracking["height_rms_m"] < 0.05


def test_one_seed_gives_one_log_to_the_bit(twice):
    first, second = (summary.log / "flight.tlog" for summary in twice)
    assert first.stat().st_size > 1_000_000
    assert first.read_bytes() == second.read_bytes()
    assert twice[0].events == twice[1].events
    rows, again = (summary.trace.tracking.rows() for summary in twice)
    assert rows == pytest.approx(again, nan_ok=True)


def test_a_step_that_the_tilt_limit_cuts_is_named_and_take_off_is_no_speed_of_ours():
    """The tilt against the wind leaves too little of the limit for a whole step."""
    with mock_vehicle(wind={"speed_m_s": 4.0}) as mock:
        summary = fly(mock, flight={"maneuvers": ["steps"]}, steps={"duration_s": 0.5})
    figures = summary.as_dict()
    checks = {check["what"]: check for check in figures["verdict"]["checks"]}
    cut = checks["tilt of the steps"]
    assert "limits.max_tilt_deg: 35" in cut["found"]
    assert not cut["good"]
    assert figures["response"]["step_size"] == pytest.approx(0.25, abs=0.02)
    assert "limits.max_tilt_deg" in checks["straightness of the steps"]["remedy"]
    motion, marks = summary.trace.motion.rows(), summary.trace.maneuvers
    ours = (motion[:, 1] >= marks[0].vehicle_time) & (motion[:, 1] < marks[-1].vehicle_time)
    assert figures["extent"]["maneuver_speed_max_m_s"] == motion[ours, 3].max()


@pytest.mark.slow
def test_another_seed_gives_another_log(tmp_path):
    logs = []
    for number, seed in enumerate((7, 7, 8)):
        with mock_vehicle(seed=seed, in_lockstep=True) as mock:
            logs.append(fly(mock, tmp_path / str(number), **HOVER).log / "flight.tlog")
    once, same, other = (log.read_bytes() for log in logs)
    assert once == same != other


def test_the_log_holds_both_directions_and_every_setpoint(twice):
    log = mavutil.mavlink_connection(str(twice[0].log / "flight.tlog"))
    stamps, answers = set(), []
    while (
        message := log.recv_match(type=["ATTITUDE_QUATERNION", "SET_ATTITUDE_TARGET"])
    ) is not None:
        if message.get_type() == "ATTITUDE_QUATERNION":
            stamps.add(message.time_boot_ms)
        else:
            answers.append(message)
    assert len(answers) == twice[0].counts.setpoints
    assert {answer.time_boot_ms for answer in answers} <= stamps
    assert {answer.type_mask for answer in answers} == {128}
    assert all(0.0 <= answer.thrust <= 0.9 for answer in answers)


@pytest.mark.slow
def test_it_flies_in_gusty_wind_on_a_half_empty_battery():
    settings = {
        "wind": {"speed_m_s": 2.0, "from_deg": 40.0, "gust_m_s": 0.7, "vertical_gust_m_s": 0.3},
        "battery": {"initial_remaining": 0.5},
    }
    with mock_vehicle(full_rate=True, **settings, in_lockstep=True) as mock:
        summary = fly(mock, **MANEUVERS)
        assert not mock.state()["crashed"]
    assert summary.result == "ok", summary.events
    assert summary.response().cross_axis_max < 0.05  # the hold in gusts is moving as a step begins
    assert summary.tracking()["height_rms_m"] < 0.3
