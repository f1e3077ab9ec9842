"""The drag that a flight learned is what the vehicle's next flight begins with."""

import pytest

from companion.config import Config
from companion.config.files import changed
from companion.config.known_drag import KnownDrag
from companion.drag import Drag
from companion.files import bounded_yaml
from companion.files.yaml_file import ConfigError, parse
from companion.flight.maneuvers import configured_maneuvers
from companion.flight.vehicle_identity import DragMemory
from companion.guidance.drag_estimate import ANY_VEHICLE, DragEstimate
from companion.preflight.evidence import Identity
from companion.recording.learned_file import LearnedFile
from tests.flight.fly import fly, mock_vehicle

BUNDLED = f"{5283920058631409231:016x}"
"""Hardware id of the bundled vehicles."""
CIRCLE = {
    "flight": {"maneuvers": ["circle"]},
    "circle": {"radius_m": 4.0, "speed_m_s": 3.0, "laps": 0.6},
    "limits": {"max_tilt_deg": 40.0},
}


def remembered(folder, told=None):
    notes = []
    estimate = DragEstimate(ANY_VEHICLE)
    config = changed(Config(), {"guidance": {"drag_per_s": told}}, "test")
    return DragMemory(config, folder, estimate, notes.append), estimate, notes


def test_a_flight_begins_with_what_was_learned_and_leaves_what_it_learned(tmp_path):
    with mock_vehicle(tmp_path, seed=3) as mock:
        LearnedFile(tmp_path, BUNDLED).save(Drag(0.7), 3.0)
        flown = fly(mock, tmp_path / "log", **CIRCLE, guidance={"drag_per_s": None})
    assert flown.result == "ok", flown.events
    (told,) = [text for _, text in flown.events if "earlier flight" in text]
    assert "linear 0.70 1/s, quadratic 0.000 1/m" in told
    assert f"learned-{BUNDLED}.json" in told
    # A key would end the learning, so none is advised and the flight is not called bad for it.
    figures = flown.as_dict()
    assert (figures["advice"], figures["settings"]) == ([], {})
    assert "began with 0.70 1/s, and the vehicle's next flight begins" in figures["drag_learned"]
    kept, _ = LearnedFile(tmp_path, BUNDLED).load()
    assert kept.drag.per_velocity(3.0) == pytest.approx(1.0, abs=0.08)


def test_a_trajectory_is_judged_by_what_was_learned(tmp_path):
    steep = {
        "flight": {"maneuvers": ["circle"]},
        "circle": {"radius_m": 5.0, "speed_m_s": 5.0},
        "limits": {"max_tilt_deg": 34.0},
        "recording": {"directory": str(tmp_path)},
    }
    config = parse(bounded_yaml.dump(steep), "test", Config)
    configured_maneuvers(config)  # 32° with 0.7 1/s
    LearnedFile(tmp_path, "aa").save(Drag(1.0), 5.0)
    with pytest.raises(ConfigError, match=r"needs 3[56].*tilt.*earlier flight learned: .*aa"):
        configured_maneuvers(config)
    told = config.model_copy(
        update={"guidance": config.guidance.model_copy(update={"drag_per_s": 0.2})}
    )
    configured_maneuvers(told)
    with pytest.raises(ConfigError, match=r"not known; up to 0.7 1/s is assumed"):
        configured_maneuvers(
            parse(
                bounded_yaml.dump(
                    {
                        **steep,
                        "limits": {"max_tilt_deg": 30.0},
                        "recording": {"directory": str(tmp_path / "absent")},
                    }
                ),
                "test",
                Config,
            )
        )


def test_another_vehicles_drag_counts_only_until_this_one_is_known(tmp_path):
    steep = {
        "flight": {"maneuvers": ["circle"]},
        "circle": {"radius_m": 5.0, "speed_m_s": 5.0},
        "guidance": {"drag_per_s": None},
        "limits": {"max_tilt_deg": 30.0},
        "recording": {"directory": str(tmp_path)},
    }
    LearnedFile(tmp_path, "aa").save(Drag(0.2), 5.0)  # 28° are enough
    with mock_vehicle(tmp_path, seed=3) as mock:
        flown = fly(mock, tmp_path / "log", **steep)
    assert flown.phase == "checks"
    assert "the vehicle's drag is not known; up to 0.7 1/s is assumed" in flown.result


def test_it_is_the_vehicles_own(tmp_path):
    LearnedFile(tmp_path, "aa").save(Drag(0.8, 0.02), 5.0)
    memory, estimate, notes = remembered(tmp_path)
    known = []
    memory.on_known_drag = known.append
    memory.load(Identity(uid=None))
    assert memory.load(Identity(uid="bb")) == KnownDrag()
    assert estimate.drag == ANY_VEHICLE.drag
    assert notes == []
    memory.load(Identity(uid="aa"))
    assert estimate.drag == Drag(0.8, 0.02)
    LearnedFile(tmp_path, "aa").save(Drag(0.1), 5.0)  # read once: each stage of the checks is alike
    assert memory.load(Identity(uid="aa")).drag == Drag(0.8, 0.02)
    assert len(notes) == 1
    assert [each.drag for each in known] == [None, None, Drag(0.8, 0.02)]
    memory.load(Identity(uid="bb"))  # another vehicle in its place
    assert estimate.drag == ANY_VEHICLE.drag


def test_what_the_configuration_tells_wins(tmp_path):
    LearnedFile(tmp_path, "aa").save(Drag(0.8), 5.0)
    memory, estimate, notes = remembered(tmp_path, told=0.3)
    assert memory.load(Identity(uid="aa")) == KnownDrag(Drag(0.3))
    assert estimate.drag == ANY_VEHICLE.drag
    assert notes == []


def test_nothing_is_kept_of_a_flight_that_hardly_moved_or_of_nobody(tmp_path):
    memory, estimate, _ = remembered(tmp_path)
    memory.load(Identity(uid="aa"))
    assert not memory.save()
    moved, estimate, _ = remembered(tmp_path)
    for n in range(600):
        fast = 4.0 if n % 200 < 100 else -4.0
        estimate.observe(0.02, (fast, 0.0, 0.0), (-0.5 * fast, 0.0))
    assert estimate.certain
    moved.load(Identity(uid=None))
    assert not moved.save()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("told", [None, 0.3])
def test_the_next_flight_begins_with_it_unless_a_drag_is_configured(tmp_path, told):
    memory, estimate, _ = remembered(tmp_path, told)
    memory.load(Identity(uid="aa"))
    for n in range(600):
        fast = 4.0 if n % 200 < 100 else -4.0
        estimate.observe(0.02, (fast, 0.0, 0.0), (-0.5 * fast, 0.0))
    assert memory.save() is (told is None)


def test_a_directory_that_cannot_be_written_costs_a_sentence(tmp_path):
    memory, estimate, notes = remembered(tmp_path / "absent")
    memory.load(Identity(uid="aa"))
    for n in range(600):
        fast = 4.0 if n % 200 < 100 else -4.0
        estimate.observe(0.02, (fast, 0.0, 0.0), (-0.5 * fast, 0.0))
    assert not memory.save()
    assert len(notes) == 1
    assert "cannot keep the learned drag" in notes[0]
