"""The fence: on which side of each limit a place lies, how far, and where the vehicle stops."""

from dataclasses import replace
from math import cos, inf, radians

import numpy as np
import pytest

from companion.guidance.fence import (
    EARTH_RADIUS,
    Fence,
    LatLon,
    distance_inside,
    inside,
    local_polygon,
)

SQUARE = ((-10.0, -10.0), (-10.0, 10.0), (10.0, 10.0), (10.0, -10.0))
FENCE = Fence(50.0, 30.0, 2.0, (), (), 2.0, 0.5)
HOME = LatLon(47.0, 8.0)


def breach(north=0.0, east=0.0, down=0.0, height=10.0, fence=FENCE, **options):
    return fence.breach((north, east, down), height, **{"origin": HOME, **options})


def test_the_limits_themselves_are_allowed():
    assert breach(30.0, 40.0) is None
    assert breach(down=-30.0) is None
    assert breach(height=2.0) is None
    assert breach(height=None) is None


@pytest.mark.parametrize(
    ("place", "limit", "words", "by"),
    [
        (
            {"north": -33.0, "east": 44.0},
            "limits.fence_radius_m",
            "55.0 m from where control began, beyond limits.fence_radius_m",
            5.0,
        ),
        (
            {"down": -32.5},
            "limits.fence_ceiling_m",
            "32.5 m above where control began, above limits.fence_ceiling_m",
            2.5,
        ),
        (
            {"height": 0.5},
            "limits.fence_floor_m",
            "0.5 m above home, below limits.fence_floor_m",
            1.5,
        ),
        (
            {"height": -4.6},
            "limits.fence_floor_m",
            "4.6 m below home, below limits.fence_floor_m",
            6.6,
        ),
    ],
)
def test_a_breach_tells_its_limit_and_how_far_outside_it_is(place, limit, words, by):
    found = breach(**place)
    assert (found.limit, str(found), found.distance_outside) == (limit, words, by)


def test_a_margin_counts_inwards_from_every_side():
    polygon = replace(FENCE, polygon=SQUARE)
    for place in ({"north": 46.0}, {"down": -26.0}, {"height": 6.0}):
        assert breach(**place, margin=4.0) is None
        assert breach(**place, margin=4.01) is not None
    assert breach(6.0, fence=polygon, margin=4.0) is None
    found = breach(6.5, fence=polygon, margin=4.0)
    assert (found.limit, found.relation, found.distance_outside) == (
        "safety.fence_polygon_m",
        "outside",
        -3.5,
    )
    where = "6.5 m north and 0.0 m east of where control began"
    assert str(found) == f"{where}, outside safety.fence_polygon_m"
    assert breach(12.0, fence=polygon).distance_outside == 0.0
    assert breach(12.0, fence=polygon, margin=1.0).distance_outside == pytest.approx(2.0)


def test_a_fence_on_the_map_needs_to_know_where_it_is():
    degree = EARTH_RADIUS * radians(1.0)
    corners = tuple(
        (47.0 + north / degree, 8.0 + east / (degree * cos(radians(47.0))))
        for north, east in SQUARE
    )
    fence = replace(FENCE, polygon_deg=corners)
    assert breach(9.9, -9.9, fence=fence) is None
    assert breach(9.9, -10.1, fence=fence).limit == "safety.fence_polygon_deg"
    unknown = breach(fence=fence, origin=None)
    assert (unknown.limit, unknown.distance_outside) == ("safety.fence_polygon_deg", 0.0)
    still = (0.0, 0.0, -5.0), (0.0, 0.0, 0.0)
    assert fence.breach_at_stopping_point(*still, 10.0, HOME) is None
    assert str(unknown) == (
        "at a place whose latitude and longitude are not known, but needed by "
        "safety.fence_polygon_deg"
    )
    flat = [value for corner in local_polygon(corners, HOME) for value in corner]
    assert flat == pytest.approx([value for corner in SQUARE for value in corner], abs=1e-5)


@pytest.mark.parametrize("origin", [180.0, -180.0, 179.99999, -179.99999])
def test_a_fence_on_the_map_may_lie_across_the_date_line(origin):
    """Fiji: some corners have positive longitudes, the others negative ones."""
    home = LatLon(-17.0, origin)
    degree = EARTH_RADIUS * radians(1.0)
    corners = tuple(
        (
            -17.0 + north / degree,
            (origin + east / (degree * cos(radians(17.0))) + 180.0) % 360.0 - 180.0,
        )
        for north, east in SQUARE
    )
    assert {longitude > 0.0 for _, longitude in corners} == {True, False}
    flat = [value for corner in local_polygon(corners, home) for value in corner]
    assert flat == pytest.approx([value for corner in SQUARE for value in corner], abs=1e-5)
    fence = replace(FENCE, polygon_deg=corners)
    assert breach(9.9, -9.9, fence=fence, origin=home) is None
    assert breach(9.9, -10.1, fence=fence, origin=home).limit == "safety.fence_polygon_deg"


def test_it_stops_after_the_reaction_and_the_braking():
    """v·t + v²/(2a): 5 m/s needs 2.5 + 6.25 m, 2 m/s down 1 + 1 m."""
    stop = FENCE.stopping_point((1.0, 2.0, -5.0), (3.0, -4.0, 2.0))
    assert stop == pytest.approx((1.0 + 0.6 * 8.75, 2.0 - 0.8 * 8.75, -3.0))
    assert FENCE.stopping_point((0.0, 0.0, 0.0), (0.0, 0.0, -2.0)) == pytest.approx(
        (0.0, 0.0, -2.0)
    )


def test_an_acceleration_lasts_for_the_reaction_time_and_one_that_brakes_does_not_count():
    fence = Fence(9.0, 5.0, 1.0, (), (), 2.5, 0.3)
    still, way = (0.0, 0.0, 0.0), (2.0, 0.0, 0.0)
    faster = fence.stopping_point(still, way, (4.0, 0.0))
    assert faster[0] == pytest.approx(2.0 * 0.3 + 4.0 * 0.09 / 2.0 + 3.2**2 / 5.0)
    assert fence.stopping_point(still, way, (-4.0, 0.0)) == fence.stopping_point(still, way)
    north, east, _ = fence.stopping_point(still, way, (0.0, 5.0))
    assert (north > 0.0, east > 0.0) == (True, True)
    places = np.zeros(2), np.zeros(2), np.zeros(2)
    ways = np.array([2.0, 2.0]), np.zeros(2), np.zeros(2)
    several = fence.stopping_point(places, ways, (np.array([4.0, -4.0]), np.zeros(2)))
    assert several[0].tolist() == pytest.approx([faster[0], fence.stopping_point(still, way)[0]])


def test_a_small_tilt_limit_and_wind_lengthen_the_stop():
    fence = Fence(50.0, 30.0, 1.0, (), (), 2.5, 0.3, tilt_acceleration=3.0)
    still, way = (0.0, 0.0, 0.0), (2.0, 0.0, -1.0)
    north, _, down = fence.stopping_point(still, way)
    assert north == pytest.approx(2.0 * 0.3 + 4.0 / (2.0 * 3.0 / 1.5))
    assert down == pytest.approx(-(0.3 + 1.0 / 5.0)), "the tilt is not needed to stop a climb"
    downwind, _, _ = fence.stopping_point(still, way, wind=(1.5, 0.0))
    assert downwind == pytest.approx(2.0 * 0.3 + 4.0 / (2.0 * 1.5 / 1.5))
    upwind, _, _ = fence.stopping_point(still, way, wind=(-1.5, 0.0))
    assert upwind == pytest.approx(2.0 * 0.3 + 4.0 / (2.0 * 2.5)), "at most the assumed one"


def test_where_it_would_stop_is_judged_with_its_height_there():
    sinking = ((0.0, 0.0, -5.0), (0.0, 0.0, 2.0))  # 2 m further down
    assert FENCE.breach_at_stopping_point(*sinking, 4.0, HOME) is None
    assert FENCE.breach_at_stopping_point(*sinking, 3.5, HOME).distance_outside == pytest.approx(
        0.5
    )
    assert (
        FENCE.breach_at_stopping_point(*sinking, 4.0, HOME, margin=0.25).limit
        == "limits.fence_floor_m"
    )
    assert FENCE.breach_at_stopping_point(*sinking, None, HOME) is None
    leaving = ((45.0, 0.0, -5.0), (5.0, 0.0, 0.0))
    assert FENCE.breach_at_stopping_point(*leaving, 10.0, HOME).distance_outside == pytest.approx(
        3.75
    )


@pytest.mark.parametrize(
    ("north", "east", "within"),
    [
        (1.25, 3.0, True),
        (1.15, 3.0, False),
        (5.9, 3.0, True),
        (6.1, 3.0, False),
        (2.3, 8.0, True),
        (2.1, 8.0, False),
        (6.9, 8.0, True),
        (7.1, 8.0, False),
        (5.0, 4.0, True),  # as far east as a corner
        (1.0, 1.9, False),
        (3.0, 12.1, False),
    ],
)
def test_slanted_sides_bound_a_polygon(north, east, within):
    triangle = ((1.0, 2.0), (11.0, 4.0), (3.0, 12.0))
    assert inside(north, east, triangle) is within
    assert inside(north, east, triangle[::-1]) is within


def test_how_far_inside_a_polygon_a_place_is():
    assert distance_inside(0.0, 3.0, SQUARE) == 7.0
    assert distance_inside(12.0, 0.0, SQUARE) == -2.0
    assert distance_inside(13.0, 14.0, SQUARE) == -5.0  # from a corner
    assert inside(9.999, -9.999, SQUARE)
    assert not inside(0.0, 10.001, SQUARE)
    small = ((0.0, 0.0), (0.0, 0.5), (0.5, 0.0))
    assert distance_inside(-1.0, 0.25, small) == -1.0
    point = ((0.0, 0.0), (0.0, 0.0), (0.0, 0.0))
    assert distance_inside(3.0, 4.0, point) == -5.0
    assert distance_inside(0.0, 0.0, (*SQUARE, SQUARE[-1])) < inf  # a corner twice is no side
