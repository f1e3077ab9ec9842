"""The helper's checks of a change: stability margins, and the trajectory that is flown."""

import pytest

from companion.config import Config
from companion.config.files import changed, load, shipped
from companion.drag import Drag
from companion.files.yaml_file import ConfigError
from companion.live.checks import ChangeChecks
from companion.recording.learned_file import LearnedFile
from companion.serve.motion_settings import change_refusal


def _after(start, *values):
    """Checks of a flight in which these changes were made."""
    checks = ChangeChecks(start, flies_maneuvers=False)
    for each in values:
        checks.check(each, "a test")
        checks.current_config = changed(checks.current_config, each, "a test")
    return checks


def test_margins_are_kept():
    px4 = load(shipped("px4.yaml"))
    gain = {"planner": {"gain_per_s": 11.0}}
    with pytest.raises(
        ConfigError, match=r"margins of only .*; .* must leave at least 4\.0 dB and 20°"
    ):
        ChangeChecks(px4, flies_maneuvers=False).check(gain, "a test")
    checks = ChangeChecks(px4, flies_maneuvers=False)
    stiff, stiffer = ({"guidance": {"position_weight_per_s4": w}} for w in (4000.0, 10000.0))
    checks.current_config = changed(px4, stiff, "a test")
    with pytest.raises(ConfigError, match="the control loop is unstable"):
        checks.check(stiffer, "a test")
    with pytest.raises(ConfigError, match=r"position_weight_per_s4 .* more than a factor of 3"):
        ChangeChecks(px4, flies_maneuvers=False).check(
            {"guidance": {"position_weight_per_s4": 10000.0}}, "a test"
        )
    small = {"planner": {"gain_per_s": 4.5}}, {"planner": {"gain_per_s": 3.5}}
    assert _after(px4, *small).current_config.planner.gain_per_s == 3.5


def test_a_loop_that_began_with_less_keeps_what_it_had():
    start = Config()  # no vehicle is identified: 14° for a heavy one
    with pytest.raises(ConfigError, match=r"must leave at least 4\.0 dB and 14°"):
        _after(start, {"planner": {"gain_per_s": 5.5}})
    _after(start, {"limits": {"max_climb_m_s": 1.0}}, {"planner": {"gain_per_s": 4.0}})


def test_a_slowed_trajectory_is_judged_as_it_is_flown(tmp_path):
    path = tmp_path / "line.csv"
    path.write_text(
        "t,x,y,z\n"
        + "".join(f"{k / 10},{4 * (k / 30) ** 2 * (3 - k / 15)},0,0\n" for k in range(31))
    )
    start = changed(
        Config(),
        {
            "flight": {"maneuvers": ["trajectory"], "trajectory": str(path), "slow_down": True},
            "limits": {"max_tilt_deg": 15.0},
        },
        "a test",
    )
    checks = ChangeChecks(start, flies_maneuvers=True)
    path.unlink()  # it is not read again
    checks.check({"limits": {"max_climb_m_s": 1.0}}, "a test")
    with pytest.raises(ConfigError, match="not slowed down again in flight"):
        checks.check({"limits": {"max_tilt_deg": 6.0}}, "a test")


def test_the_flown_vehicles_drag_replaces_that_of_the_vehicle_that_flew_last(tmp_path):
    circle = {
        "flight": {"maneuvers": ["circle"]},
        "circle": {"radius_m": 5.0, "speed_m_s": 5.0},
        "limits": {"max_tilt_deg": 35.0},
        "recording": {"directory": tmp_path},
    }
    LearnedFile(tmp_path, "aa").save(Drag(0.2), 5.0)  # 28° are enough
    checks = ChangeChecks(changed(Config(), circle, "a test"), flies_maneuvers=True)
    less_tilt = {"limits": {"max_tilt_deg": 30.0}}
    checks.check(less_tilt, "a test")
    checks.note_drag({"drag": None, "source": None})
    with pytest.raises(ConfigError, match=r"not known; up to 0\.7 1/s is assumed"):
        checks.check(less_tilt, "a test")
    checks.note_drag({"drag": [0.3, 0.0], "source": "learned-bb.json"})
    checks.check(less_tilt, "a test")


@pytest.mark.parametrize("key", ["max_climb_m_s", "max_descent_m_s", "max_yaw_rate_deg_s"])
def test_limits_of_a_clients_motion_stay_while_it_is_in_control(key):
    before = Config()
    after = changed(before, {"limits": {key: 0.5 * getattr(before.limits, key)}}, "a test")
    told = change_refusal(before, after)
    assert told == f"limits.{key} must not change while a client is in control"
