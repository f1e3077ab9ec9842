"""Reading the parameters that matter, under whichever of their names the autopilot knows them."""

import asyncio

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from companion.preflight import parameter_survey
from companion.preflight.parameter_survey import RetryPolicy, Survey, survey_parameters
from companion.vehicle.ardupilot.parameters import ARDUPILOT_PARAMETERS
from companion.vehicle.px4.parameters import PX4_PARAMETERS
from tests.mavlink.fakes import linked

OLD = {"SYSID_MYGCS": 255.0, "FS_OPTIONS": 16.0}
WANTED = ("FS_OPTIONS", "MAV_GCS_SYSID", "ARMING_SKIPCHK")


@pytest.fixture(autouse=True)
def quick_rounds(monkeypatch):
    monkeypatch.setattr(parameter_survey, "_FIRST_ROUND", RetryPolicy(0.05, 2))
    monkeypatch.setattr(parameter_survey, "_SECOND_ROUND", RetryPolicy(0.05, 3))


def test_an_old_version_answers_to_the_old_names(monkeypatch):
    monkeypatch.setattr(parameter_survey, "_FIRST_ROUND", RetryPolicy(0.05, 1))
    rules = [rule for rule in ARDUPILOT_PARAMETERS if rule.name in WANTED]
    asked = []

    def answer(request):
        asked.append(request.param_id)
        if request.param_id not in OLD:
            return []
        name = request.param_id.encode()
        return [dialect.MAVLink_param_value_message(name, OLD[request.param_id], 9, 2, 0)]

    async def scene():
        async with linked() as (link, vehicle):
            vehicle.answers["PARAM_REQUEST_READ"] = answer
            return await survey_parameters(link, rules)

    values, names, untold, link_loses_frames = asyncio.run(scene())
    assert (untold, link_loses_frames) == ({"ARMING_SKIPCHK"}, False)
    assert values == {"MAV_GCS_SYSID": 255.0, "FS_OPTIONS": 16.0}
    assert names == {"MAV_GCS_SYSID": "SYSID_MYGCS", "FS_OPTIONS": "FS_OPTIONS"}
    # All are asked for before the first has an answer; the old name only after the new had none.
    assert asked == ["MAV_GCS_SYSID", "FS_OPTIONS", "ARMING_SKIPCHK", "SYSID_MYGCS"]


def test_asked_again_it_is_asked_for_what_it_told_before_alone():
    """What it has not costs seconds each time; an old name is known by now."""
    rules = [rule for rule in ARDUPILOT_PARAMETERS if rule.name in WANTED]
    asked = []

    def answer(request):
        asked.append(request.param_id)
        name = request.param_id.encode()
        return [dialect.MAVLink_param_value_message(name, 7.0, 9, 2, 0)]

    async def scene():
        async with linked() as (link, vehicle):
            vehicle.answers["PARAM_REQUEST_READ"] = answer
            names = {"MAV_GCS_SYSID": "SYSID_MYGCS", "FS_OPTIONS": "FS_OPTIONS"}
            told = dict.fromkeys(names, 1.0)
            before = Survey(told, names, frozenset({"ARMING_SKIPCHK"}))
            return await survey_parameters(link, rules, earlier_survey=before)

    values, names, untold, _ = asyncio.run(scene())
    assert asked == ["SYSID_MYGCS", "FS_OPTIONS"]
    assert values == {"MAV_GCS_SYSID": 7.0, "FS_OPTIONS": 7.0}
    assert names["MAV_GCS_SYSID"] == "SYSID_MYGCS"
    assert untold == {"ARMING_SKIPCHK"}


class Lossy:
    """A vehicle that has `VALUES` on a link that loses the first questions for some of them.

    Args:
        lost: How many, by name.
        says_no: Whether it says of other names that it has none.
        gaps: Whether frames of its own are lost, too.
    """

    VALUES = ("COM_OF_LOSS_T", "COM_OBL_RC_ACT")

    def __init__(self, lost, *, says_no=False, gaps=False):
        self.lost, self.says_no, self.gaps = dict(lost), says_no, gaps
        self.asked = []

    def answer(self, vehicle, request):
        name = request.param_id
        self.asked.append(name)
        if self.gaps:
            vehicle.mav.seq = (vehicle.mav.seq + 3) & 0xFF
        if self.lost.get(name, 0) > 0:
            self.lost[name] -= 1
            return []
        if name in self.VALUES:
            return [dialect.MAVLink_param_value_message(name.encode(), 1.0, 9, 2, 0)]
        if self.says_no:
            return [dialect.MAVLink_param_error_message(1, 191, name.encode(), -1, 1)]
        return []

    def survey(self):
        """COM_OF_LOSS_T, COM_OBL_RC_ACT and MAN_OVERRIDE_SPD; twice first, then three times."""
        wanted = (*self.VALUES, "MAN_OVERRIDE_SPD")
        rules = [rule for rule in PX4_PARAMETERS if rule.name in wanted]

        async def scene():
            async with linked() as (link, vehicle):
                vehicle.answers["PARAM_REQUEST_READ"] = lambda request: self.answer(
                    vehicle, request
                )
                return await survey_parameters(link, rules)

        return asyncio.run(scene())


def test_on_a_good_link_what_gets_no_answer_is_not_asked_for_once_more():
    """An older PX4 says nothing of what it has not, and that must not cost time twice."""
    vehicle = Lossy({})
    read = vehicle.survey()
    assert (set(read.values), read.unread_names, read.link_loses_frames) == (
        set(Lossy.VALUES),
        {"MAN_OVERRIDE_SPD"},
        False,
    )
    assert vehicle.asked.count("MAN_OVERRIDE_SPD") == 2


def test_where_a_question_was_lost_the_others_are_asked_for_once_more_after_all():
    vehicle = Lossy({"COM_OF_LOSS_T": 1, "COM_OBL_RC_ACT": 4})
    read = vehicle.survey()
    assert read.values == {"COM_OF_LOSS_T": 1.0, "COM_OBL_RC_ACT": 1.0}
    assert (read.unread_names, read.link_loses_frames) == ({"MAN_OVERRIDE_SPD"}, True)
    assert vehicle.asked.count("COM_OF_LOSS_T") == 2
    assert vehicle.asked.count("COM_OBL_RC_ACT") == 2 + 3


def test_where_the_vehicles_frames_are_lost_they_are_too():
    vehicle = Lossy({"COM_OBL_RC_ACT": 2}, gaps=True)
    read = vehicle.survey()
    assert (set(read.values), read.link_loses_frames) == (set(Lossy.VALUES), True)


def test_what_the_autopilot_says_it_has_not_is_neither_untold_nor_asked_for_again():
    vehicle = Lossy({"COM_OF_LOSS_T": 1, "COM_OBL_RC_ACT": 9}, says_no=True)
    read = vehicle.survey()
    assert (read.unread_names, read.link_loses_frames) == ({"COM_OBL_RC_ACT"}, True)
    assert vehicle.asked.count("MAN_OVERRIDE_SPD") == 1
    assert vehicle.asked.count("COM_OBL_RC_ACT") == 2 + 3  # and no more: it is bounded


def test_who_answers_nothing_is_not_asked_for_long():
    vehicle = Lossy(dict.fromkeys(Lossy.VALUES, 99), gaps=True)
    read = vehicle.survey()
    assert (read.values, len(read.unread_names)) == ({}, 3)
    assert len(vehicle.asked) == 3 * 2
