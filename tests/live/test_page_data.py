"""The data on the live page."""

import pytest

from companion.config import Config
from companion.config.files import changed
from companion.live.page.page_data import PageData


@pytest.fixture
def page_data():
    return PageData(Config())


def status(time, **more):
    return {"kind": "status", "time_s": time, **more}


def test_the_last_30_seconds_are_kept_and_only_new_states_are_given_out(page_data):
    for tenths in range(0, 400, 2):
        page_data.take(status(tenths / 10.0))
    assert [page_data.states[0]["time_s"], page_data.states[-1]["time_s"]] == pytest.approx(
        [9.8, 39.8]
    )
    assert "kind" not in page_data.states[0]
    assert page_data.state_count == 200
    assert [each["time_s"] for each in page_data.states_since(198)] == pytest.approx([39.6, 39.8])
    assert page_data.states_since(page_data.state_count) == []
    assert page_data.states_since(0) == list(page_data.states)


def test_a_second_flight_begins_with_an_empty_plot(page_data):
    page_data.take(status(20.0))
    page_data.take(status(1.0))
    assert [each["time_s"] for each in page_data.states] == [1.0]
    assert page_data.states_since(1) == [{"time_s": 1.0}]


def test_a_phase_is_an_event_at_the_newest_state(page_data):
    page_data.take({"kind": "phase", "name": "connect", "waits_for": ""})
    page_data.take(status(4.0))
    page_data.take({"kind": "phase", "name": "takeoff", "waits_for": "the altitude"})
    page_data.take({"kind": "event", "time_s": 5.0, "text": "maneuver: hover"})
    assert page_data.events_since(0) == [
        {"time_s": 0.0, "text": "phase: connect"},
        {"time_s": 4.0, "text": "phase: takeoff"},
        {"time_s": 5.0, "text": "maneuver: hover"},
    ]
    assert page_data.events_since(2) == [{"time_s": 5.0, "text": "maneuver: hover"}]
    assert page_data.events_since(3) == []


def test_a_message_of_another_kind_changes_nothing(page_data):
    page_data.take({"kind": "answer", "id": 1, "refusal": None})
    assert (page_data.state_count, page_data.event_count, page_data.end_text) == (0, 0, None)


def test_the_words_of_the_flight_about_its_end_are_kept(page_data):
    page_data.end()
    assert page_data.end_text == "the program that flew has ended"
    page_data.take({"kind": "end", "text": "the flight is over"})
    page_data.end()
    assert page_data.end_text == "the flight is over"


def test_changed_values_are_yaml_by_section_with_their_former_values(page_data):
    told = {"limits": {"max_climb_m_s": 1.5, "fence_radius_m": 40.0}, "planner": {"gain_per_s": 4}}
    config = changed(page_data.config, told, "a test").model_dump(mode="json")
    page_data.take({"kind": "config", "config": config, "can_undo": True})
    assert page_data.can_undo
    assert page_data.fence()["radius_m"] == 40.0
    comment, *lines = page_data.changed_yaml().splitlines()
    assert comment.startswith("# Changed in flight")
    assert lines == [
        "planner:",
        f"  gain_per_s: 4.0  # was {page_data.start_config.planner.gain_per_s}",
        "limits:",
        f"  max_climb_m_s: 1.5  # was {page_data.start_config.limits.max_climb_m_s}",
        f"  fence_radius_m: 40.0  # was {page_data.start_config.limits.fence_radius_m}",
    ]
