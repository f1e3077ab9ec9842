"""The fence is judged before the flight as it is watched in flight: what is accepted is flown."""

import numpy as np
import pytest
import yaml

from companion.config import Config
from companion.config.known_drag import drag_before_connecting
from companion.drag import Drag
from companion.files.yaml_file import ConfigError, parse
from companion.flight.fence_check import TRACKING_MARGIN, FenceCheck
from companion.flight.maneuver_checks import require_inside
from companion.flight.maneuvers import configured_maneuvers
from companion.guidance import Pose
from companion.guidance.fence import Fence, LatLon, distance_inside
from companion.guidance.predicted import predict
from companion.guidance.trajectory.demand import Motion
from companion.safety.motion_breaches import braking
from companion.safety.snapshot import Motion as Now
from companion.safety.snapshot import Snapshot
from companion.safety.table import fence_of
from tests.flight.fly import fly, merged, mock_vehicle

START = Pose((0.0, 0.0, 0.0), 0.0)
LINE = "line: {to_m: [7.5, 0, 0], speed_m_s: 3}"
ROUND = {"flight": {"maneuvers": ["circle"]}, "circle": {"radius_m": 3.5, "speed_m_s": 3.0}}


def config_of(*parts, **more):
    out = {}
    for part in (*parts, more):
        out = merged(out, part)
    return parse(yaml.safe_dump(out), "test", Config)


def following(tmp_path, text):
    path = tmp_path / "way.yaml"
    path.write_text(text)
    return {"flight": {"maneuvers": ["trajectory"], "trajectory": str(path)}}


def refusal(*parts, **more):
    with pytest.raises(ConfigError) as refused:
        configured_maneuvers(config_of(*parts, **more))
    return str(refused.value)


def smallest_fence(*parts):
    """The smallest radius that is accepted, to a centimetre."""
    too_small, enough = 0.0, 50.0
    while enough - too_small > 0.01:
        radius = 0.5 * (too_small + enough)
        try:
            configured_maneuvers(config_of(*parts, limits={"fence_radius_m": radius}))
        except ConfigError:
            too_small = radius
        else:
            enough = radius
    return enough


def test_a_line_that_ends_inside_but_could_not_stop_there_is_refused(tmp_path):
    """The demonstrated one: 7.5 m, rest to rest, inside 8 m."""
    told = refusal(following(tmp_path, LINE), limits={"fence_radius_m": 8.0})
    assert "braking would end up to 0." in told
    assert "limits.fence_radius_m" in told
    assert "fly more slowly (for a trajectory, --slow-down" in told
    slow = merged(following(tmp_path, LINE), {"flight": {"slow_down": True}})
    (part,) = configured_maneuvers(config_of(slow, limits={"fence_radius_m": 8.01})).parts
    assert any("because of limits.fence_radius_m at" in note for note in part.notes)
    (quick,) = configured_maneuvers(config_of(slow, limits={"fence_radius_m": 30.0})).parts
    assert part.duration > 1.02 * quick.duration


@pytest.mark.parametrize(
    ("text", "limits", "words"),
    [
        (
            "line: {to_m: [10, 0, 0], speed_m_s: 2}",
            {},
            "goes up to 2.0 m outside the fence (10.0 m",
        ),
        ("circle: {radius_m: 5, speed_m_s: 2}", {}, "goes up to 2.0 m outside the fence (10.0 m"),
        (
            "line: {to_m: [0, 0, -9], speed_m_s: 1}",
            {"fence_ceiling_m": 7},
            "2.0 m outside the fence (9.0 m above",
        ),
        (
            "line: {to_m: [0, 0, 5], speed_m_s: 1}",
            {},
            "1.0 m outside the fence (0.0 m above home; limits.fence_fl",
        ),
    ],
)
@pytest.mark.parametrize("slow", [False, True])
def test_slowing_down_is_not_advised_where_it_does_not_help(tmp_path, text, limits, words, slow):
    way = merged(following(tmp_path, text), {"flight": {"slow_down": slow}})
    told = refusal(way, limits={"fence_radius_m": 8.0, **limits})
    assert words in told
    assert told.endswith("make the path smaller, or widen the fence")
    assert "slow" not in told.removeprefix(way["flight"]["trajectory"])


SQUARE = [[-2.0, -2.0], [9.0, -2.0], [9.0, 2.0], [-2.0, 2.0]]
NOTCHED = [[-2, -2], [9, -2], [9, 2], [4.1, 2], [4.0, -0.4], [3.9, 2], [-2, 2]]


@pytest.mark.parametrize(
    ("to", "corners", "words"),
    [
        ("[7, 0, 0]", SQUARE, None),
        ("[8.4, 0, 0]", SQUARE, "braking would end"),
        ("[12, 0, 0]", SQUARE, "outside the fence"),
        ("[7, 0, 0]", NOTCHED, "comes too near to the fence"),
    ],
)
def test_a_polygon_is_judged_all_along_the_way(tmp_path, to, corners, words):
    way = following(tmp_path, f"line: {{to_m: {to}, speed_m_s: 3}}")
    polygon = {"safety": {"fence_polygon_m": corners}}
    if words is None:
        configured_maneuvers(config_of(way, polygon))
    else:
        told = refusal(way, polygon)
        assert words in told
        assert "safety.fence_polygon_m" in told


def test_a_polygon_on_the_map_is_judged_as_soon_as_the_place_is_known():
    here = LatLon(47.0, 8.0)
    side = 10.0 / 111_195.0
    corners = [[47.0 - side, 7.9999], [47.0 + side, 7.9999], [47.0 + side, 8.0001]]
    corners.append([47.0 - side, 8.0001])
    round_ = config_of(
        {"flight": {"maneuvers": ["circle"]}, "circle": {"radius_m": 8.0}},
        safety={"fence_polygon_deg": corners},
    )
    parts = configured_maneuvers(round_).parts
    with pytest.raises(
        ConfigError, match=r"goes up to .* outside the fence .* safety\.fence_polygon_deg"
    ):
        require_inside(round_, parts, here, drag_before_connecting(round_))
    small = config_of(
        ROUND, circle={"radius_m": 3.0, "speed_m_s": 1.0}, safety={"fence_polygon_deg": corners}
    )
    require_inside(small, configured_maneuvers(small).parts, here, drag_before_connecting(small))


@pytest.mark.parametrize(
    ("flight", "limits", "words"),
    [
        ({"maneuvers": ["hover"]}, {"fence_ceiling_m": 0.4}, "hover: from 0.00 s on"),
        ({"maneuvers": ["steps"]}, {"fence_radius_m": 2.5}, "steps: from"),
        ({"maneuvers": ["corners"]}, {"fence_radius_m": 4.0}, "corners: from"),
        ({"maneuvers": ["identify"]}, {"fence_radius_m": 0.6}, "identify: from"),
        ({"maneuvers": ["identify"]}, {"fence_ceiling_m": 0.6}, "identify: from"),
        ({"maneuvers": ["hover", "circle"]}, {"fence_radius_m": 6.0}, "circle: from"),
        ({"maneuvers": ["hover"], "takeoff_height_m": 1.5}, {"fence_floor_m": 1.1}, "hover: from"),
    ],
)
def test_every_maneuver_is_judged(flight, limits, words):
    assert words in refusal(flight=flight, limits=limits)


def test_the_ideal_doublet_ends_where_it_began():
    for name in ("steps", "corners"):
        (part,) = configured_maneuvers(config_of(flight={"maneuvers": [name]})).parts
        moments = list(predict(part))
        assert np.linalg.norm(moments[-1].offset) < 0.05
        far = max(np.hypot(*moment.offset[:2]) for moment in moments)
        assert 2.0 < far < 25.0
        dragged = max(np.hypot(*moment.offset[:2]) for moment in predict(part, drag=Drag(1.0)))
        assert dragged < 0.9 * far


@pytest.mark.parametrize("seed", range(4))
def test_what_is_accepted_never_makes_the_monitor_speak(seed):
    """The monitor itself, at every moment of the reference and everywhere off it by the margin."""
    rng = np.random.default_rng(seed)
    flight = ROUND if seed % 2 else {"flight": {"maneuvers": ["steps"]}}
    fence = {"limits": {"fence_radius_m": smallest_fence(flight)}}
    config = config_of(flight, fence)
    check = braking(fence_of(config))
    (part,) = configured_maneuvers(config).parts
    for moment in predict(part):
        off = rng.normal(size=3)
        off *= 0.999 * (TRACKING_MARGIN - 0.13) / np.linalg.norm(off)
        place = tuple((np.array(moment.offset) + off).tolist())
        now = Now(
            offset=place,
            velocity=moment.velocity,
            height=5.0 - place[2],
            acceleration=moment.acceleration[:2],
        )
        assert check(Snapshot(0.0, motion=now), False) is None


def test_the_distance_to_a_polygon():
    assert distance_inside(0.0, 0.0, SQUARE) == 2.0
    assert distance_inside(8.5, 0.0, SQUARE) == 0.5
    assert distance_inside(12.0, 6.0, SQUARE) == -5.0


def test_the_worst_moment_is_found_among_all():
    """Against a judgement of each moment by itself."""
    rng = np.random.default_rng(3)
    fence = Fence(9.0, 5.0, 1.0, (), (), 2.5, 0.3)
    for _ in range(200):
        place, speed = rng.uniform(-6, 6, (20, 3)), rng.uniform(-3, 3, (20, 3))
        change, none = rng.uniform(-3, 3, (20, 3)), np.zeros((20, 3))
        motion = Motion(np.arange(20.0), place, speed, change, none, none[:, 0])
        each = [
            fence.breach_at_stopping_point(
                tuple(p), tuple(v), 5.0 - p[2], None, TRACKING_MARGIN, (a[0], a[1])
            )
            for p, v, a in zip(place.tolist(), speed.tolist(), change.tolist(), strict=True)
        ]
        found = FenceCheck(fence, 5.0)(motion)
        assert (found is None) is all(one is None for one in each)


GUSTY = {"speed_m_s": 3.0, "gust_m_s": 1.0}


@pytest.mark.parametrize(
    ("way", "autopilot"),
    [
        ("line", "px4"),
        ("circle", "px4"),
        pytest.param("line", "ardupilot", marks=pytest.mark.slow),
        ("circle", "ardupilot"),
    ],
)
def test_what_is_just_accepted_is_flown_in_gusts_and_what_is_just_not_is_refused(
    tmp_path, way, autopilot
):
    flight = following(tmp_path, LINE) if way == "line" else ROUND
    flight = merged(flight, {"flight": {"takeoff_height_m": 2.0, "arm": True}})
    radius = smallest_fence(flight)
    refusal(flight, limits={"fence_radius_m": radius - 0.02})
    with mock_vehicle(wind=GUSTY, seed=5, autopilot=autopilot) as mock:
        summary = fly(mock, None, limits={"fence_radius_m": radius}, **flight)
    assert summary.result == "ok", summary.events
    assert not [text for _, text in summary.events if text.startswith("safety: ")]
