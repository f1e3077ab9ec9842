"""ArduPilot's commands and parameters, apart from flying."""

from math import nan

import pytest
from ardupilot_rig import FAILED, GUIDED, ArduRig
from mock_rig import ACCEPTED, DENIED, UNSUPPORTED
from pymavlink.dialects.v20 import development as dialect

from sitl_mock.__main__ import main
from sitl_mock.settings import MockSettings
from sitl_mock.simulation import Simulation

INT8, INT16, INT32, REAL32 = 2, 4, 6, 9


@pytest.fixture
def rig():
    return ArduRig(prearm_delay_s=0.1)


def read(rig, name, index=-1):
    rig.say(dialect.MAVLink_param_request_read_message(1, 1, name.encode(), index))
    return rig.messages("PARAM_VALUE")[-1]


def write(rig, name, value, kind):
    rig.say(dialect.MAVLink_param_set_message(1, 1, name.encode(), value, kind))
    return rig.messages("PARAM_VALUE")[-1]


def test_unknown_commands_and_modes(rig):
    assert rig.command(31000) == UNSUPPORTED
    assert rig.switch(99) == FAILED
    assert rig.command(176, 0, GUIDED) == DENIED  # not marked as a custom mode
    assert rig.switch(nan) == DENIED
    assert rig.switch(GUIDED) == ACCEPTED
    assert rig.state.mode.name == "GUIDED"


def test_its_version_by_either_command(rig):
    assert rig.command(512, 148) == rig.command(520, 1) == ACCEPTED
    first, second = rig.messages("AUTOPILOT_VERSION")
    assert first.flight_sw_version >> 16 == second.flight_sw_version >> 16 == 0x0407
    assert first.capabilities == 64495
    assert bytes(first.flight_custom_version) == b"12f6aa4e"
    assert (first.uid, len(first.uid2), first.board_version) == (0, 18, 0)
    assert any(first.uid2), "its own hardware id: what PX4's mock learned is of another vehicle"


@pytest.mark.parametrize(
    ("target", "answers"), [((1, 1), 1), ((1, 0), 1), ((0, 0), 1), ((1, 42), 1), ((42, 1), 0)]
)
def test_any_component_of_the_system_is_it(rig, target, answers):
    rig.say(dialect.MAVLink_command_long_message(*target, 512, 0, 148, 0, 0, 0, 0, 0, 0))
    assert len(rig.messages("COMMAND_ACK")) == answers


def test_parameters_travel_as_floats_with_their_own_types(rig):
    value = read(rig, "GUID_OPTIONS")
    assert (value.param_value, value.param_type, value.param_index) == (0.0, INT32, 65535)
    assert read(rig, "SCHED_LOOP_RATE").param_value == 400.0
    assert read(rig, "SCHED_LOOP_RATE").param_type == INT16
    assert read(rig, "MOT_THST_HOVER").param_type == REAL32
    value = write(rig, "GUID_OPTIONS", 8.0, REAL32)  # recorded: the type sent does not matter
    assert (value.param_value, value.param_type) == (8.0, INT32)
    assert rig.simulation.parameters["GUID_OPTIONS"] == 8
    rig.say(dialect.MAVLink_param_set_message(1, 1, b"GUID_OPTIONS", nan, REAL32))
    assert rig.simulation.parameters["GUID_OPTIONS"] == 8
    rig.say(dialect.MAVLink_param_request_read_message(1, 1, b"SYSID_MYGCS", -1))
    assert rig.messages("PARAM_ERROR")[-1].error == dialect.MAV_PARAM_ERROR_DOES_NOT_EXIST


def test_px4s_hash_is_no_parameter_here(rig):
    answers = len(rig.messages("PARAM_ERROR"))
    rig.say(dialect.MAVLink_param_set_message(1, 1, b"_HASH_CHECK", 1.0, 9))
    rig.run(0.1)
    assert len(rig.messages("PARAM_ERROR")) == answers + 1


def test_the_whole_list_comes_without_a_hash(rig):
    before = len(rig.messages("PARAM_VALUE"))
    rig.say(dialect.MAVLink_param_request_list_message(1, 1))
    rig.run(0.5)
    listed = rig.messages("PARAM_VALUE")[before:]
    assert [m.param_index for m in listed] == list(range(listed[0].param_count))
    assert {"MAV_GCS_SYSID", "FS_GCS_ENABLE", "ATC_ANGLE_BOOST"} < {m.param_id for m in listed}


def test_a_second_vehicle_has_its_own_system_id():
    second = Simulation(MockSettings(autopilot="ardupilot"), 2)
    assert second.parameters["MAV_SYSID"] == 2


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("{autopilot: ardupilott}", ("mock.autopilot", "px4 or ardupilot")),
        ("{autopilot: ardupilot, parameters: {COM_OF_LOSS_T: 1}}", ("COM_OF_LOSS_T",)),
        ("{autopilot: ardupilot, parameters: {GUID_OPTION: 8}}", ("did you mean GUID_OPTIONS?",)),
        ("{autopilot: ardupilot, airframe: 3}", ("mock.airframe",)),
    ],
)
def test_mistakes_are_told(text, words, tmp_path, capsys):
    path = tmp_path / "mock.yaml"
    path.write_text(f"mock: {text}\n")
    assert main(["--config", str(path), "--check"]) == 2
    errors = capsys.readouterr().err
    assert errors.count("\n") == 1
    assert all(word in errors for word in words)


def test_what_is_given_of_the_airframe_leaves_the_rest_as_measured():
    settings = MockSettings.model_validate(
        {"autopilot": "ardupilot", "airframe": {"drag_n_s_per_m": 0.5}}
    )
    assert settings.airframe.drag_n_s_per_m == 0.5
    assert settings.airframe.rotor_lag_ms == 22.5
    assert settings.prearm_delay_s == pytest.approx(41.6)
    word = MockSettings.model_validate({"autopilot": "ardupilot", "rate_loop": "ardupilot"})
    assert word.rate_loop == settings.rate_loop
