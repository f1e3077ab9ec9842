"""The data on the live page."""

import pytest

from companion.config import Config
from companion.config.files import changed
from companion.live.page.store import Store


@pytest.fixture
def store():
    return Store(Config())


def status(time, **more):
    return {"kind": "status", "time_s": time, **more}


def test_the_last_30_seconds_are_kept_and_only_new_states_are_given_out(store):
    for tenths in range(0, 400, 2):
        store.take(status(tenths / 10.0))
    assert [store.states[0]["time_s"], store.states[-1]["time_s"]] == pytest.approx([9.8, 39.8])
    assert "kind" not in store.states[0]
    assert store.state_count == 200
    assert [each["time_s"] for each in store.states_since(198)] == pytest.approx([39.6, 39.8])
    assert store.states_since(store.state_count) == []
    assert store.states_since(0) == list(store.states)


def test_a_second_flight_begins_with_an_empty_plot(store):
    store.take(status(20.0))
    store.take(status(1.0))
    assert [each["time_s"] for each in store.states] == [1.0]
    assert store.states_since(1) == [{"time_s": 1.0}]


def test_a_phase_is_an_event_at_the_newest_state(store):
    store.take({"kind": "phase", "name": "connect", "waits_for": ""})
    store.take(status(4.0))
    store.take({"kind": "phase", "name": "takeoff", "waits_for": "the altitude"})
    store.take({"kind": "event", "time_s": 5.0, "text": "maneuver: hover"})
    assert store.events_since(0) == [
        {"time_s": 0.0, "text": "phase: connect"},
        {"time_s": 4.0, "text": "phase: takeoff"},
        {"time_s": 5.0, "text": "maneuver: hover"},
    ]
    assert store.events_since(2) == [{"time_s": 5.0, "text": "maneuver: hover"}]
    assert store.events_since(3) == []


def test_a_message_of_another_kind_changes_nothing(store):
    store.take({"kind": "answer", "id": 1, "refusal": None})
    assert (store.state_count, store.event_count, store.end_text) == (0, 0, None)


def test_the_words_of_the_flight_about_its_end_are_kept(store):
    store.end()
    assert store.end_text == "the program that flew has ended"
    store.take({"kind": "end", "text": "the flight is over"})
    store.end()
    assert store.end_text == "the flight is over"


def test_changed_values_are_yaml_by_section_with_their_former_values(store):
    told = {"limits": {"max_climb_m_s": 1.5, "fence_radius_m": 40.0}, "planner": {"gain_per_s": 4}}
    config = changed(store.config, told, "a test").model_dump(mode="json")
    store.take({"kind": "config", "config": config, "can_undo": True})
    assert store.can_undo
    assert store.fence()["radius_m"] == 40.0
    comment, *lines = store.changed_yaml().splitlines()
    assert comment.startswith("# Changed in flight")
    assert lines == [
        "planner:",
        f"  gain_per_s: 4.0  # was {store.start.planner.gain_per_s}",
        "limits:",
        f"  max_climb_m_s: 1.5  # was {store.start.limits.max_climb_m_s}",
        f"  fence_radius_m: 40.0  # was {store.start.limits.fence_radius_m}",
    ]
