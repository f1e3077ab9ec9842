"""Every mask and frame of the setpoint messages, packed by pymavlink and judged by the documents.

Rules: PX4 "Offboard Mode" (position; velocity; acceleration; position and velocity; all three;
LOCAL_NED, BODY_NED), ArduPilot "Copter Commands in Guided Mode" (the same masks; LOCAL_NED,
LOCAL_OFFSET_NED, BODY_NED, BODY_OFFSET_NED), MAVLink common (BODY_FRD, GLOBAL frames).
"""

import math

import numpy as np
import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from companion.guidance.fence import EARTH_RADIUS
from companion.mavlink.framing import FrameScanner
from companion.serve.network.addresses import Address
from companion.serve.setpoints.decoding import decode_setpoint
from companion.serve.setpoints.request import (
    AttitudeRequest,
    MotionRequest,
    Origin,
    RatesRequest,
    RefusedSetpoint,
    VehiclePose,
)
from companion.serve.vehicle_pose import OriginEstimate

LOCAL, OFFSET, BODY, BODY_OFFSET, BODY_FRD = 1, 7, 8, 9, 12
POSITION, VELOCITY, ACCELERATION = (3.0, -4.0, -5.5), (1.25, 2.5, -0.5), (0.5, -0.25, 0.125)
YAW, YAW_RATE = 0.75, -0.375
HERE, HEADING = (10.0, 20.0, -30.0), 0.6
ORIGIN = Origin(47.4, 8.5, 450.0, 440.0)
POSE = VehiclePose(HERE, HEADING, ORIGIN)
TARGETS = Address(1, 1), Address(1, 191)


def understand(message, pose=POSE, *, ardupilot=False):
    raw = message.pack(dialect.MAVLink(None, 245, 190))
    (frame,) = FrameScanner().feed(raw)
    return decode_setpoint(frame, pose, TARGETS, body_yaw_is_relative=ardupilot)


MOTION = {
    **dict(zip(("vx", "vy", "vz"), VELOCITY, strict=True)),
    **dict(zip(("afx", "afy", "afz"), ACCELERATION, strict=True)),
    "yaw": YAW,
    "yaw_rate": YAW_RATE,
}


def local(mask, frame=LOCAL, target=(1, 1), **changed):
    values = dict(zip(("x", "y", "z"), POSITION, strict=True)) | MOTION | changed
    return dialect.MAVLink_set_position_target_local_ned_message(
        1234, *target, frame, mask, **values
    )


def is_documented(mask, frame):
    """Whether a mask and a frame command something that means the same to both autopilots."""
    used = [mask >> bit & 1 == 0 for bit in range(9)]
    position, velocity, acceleration = used[:3], used[3:6], used[6:9]
    if (mask & 512 and any(acceleration)) or (frame == BODY and any(position)):
        return False
    for x, y, _ in (position, velocity, acceleration):
        if x != y:
            return False
    for axis in (0, 2):
        given = position[axis], velocity[axis], acceleration[axis]
        if given in ((False, False, False), (True, False, True)):
            return False
    return True


def expected(mask, frame):
    c, s = math.cos(HEADING), math.sin(HEADING)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    rotation = turn if frame in (BODY, BODY_OFFSET, BODY_FRD) else np.eye(3)
    start = np.array(HERE) if frame in (OFFSET, BODY_OFFSET, BODY_FRD) else np.zeros(3)
    return rotation @ POSITION + start, rotation @ VELOCITY, rotation @ ACCELERATION


@pytest.mark.parametrize("frame", [LOCAL, OFFSET, BODY, BODY_OFFSET, BODY_FRD])
def test_every_mask_in_every_local_frame(frame):
    flown = 0
    for mask in range(4096):
        if not is_documented(mask, frame):
            with pytest.raises(RefusedSetpoint, match=r"^.{10,100}$"):
                understand(local(mask, frame))
            continue
        request = understand(local(mask, frame))
        flown += 1
        for bits, name, values in zip(
            ((0, 2), (3, 5), (6, 8)),
            ("position", "velocity", "acceleration"),
            expected(mask, frame),
            strict=True,
        ):
            horizontal, vertical = (
                getattr(request.horizontal, name),
                getattr(request.vertical, name),
            )
            assert (horizontal is None) == bool(mask >> bits[0] & 1)
            assert (vertical is None) == bool(mask >> bits[1] & 1)
            if horizontal is not None:
                assert horizontal == pytest.approx(tuple(values[:2]), abs=1e-5)
            if vertical is not None:
                assert vertical == pytest.approx((values[2],), abs=1e-5)
        assert request.yaw == (None if mask & 1024 else pytest.approx(YAW))
        assert request.yaw_rate == (None if mask & 2048 else pytest.approx(YAW_RATE))
    assert flown == (40 if frame == BODY else 180)


@pytest.mark.parametrize(
    ("mask", "groups"),
    [
        (0x0DF8, "p"),
        (0x0DC7, "v"),
        (0x0C3F, "a"),
        (0x0DC0, "pv"),
        (0x0C00, "pva"),
        (0x09C7, "v and yaw"),
        (0x05C7, "v and yaw rate"),
        (0b0000111111000111, "v"),  # of DroneKit's examples: the force bit without acceleration
        (0b0000111111111000, "p"),
    ],
)
def test_the_masks_that_ardupilot_lists(mask, groups):
    request = understand(local(mask))
    given = request.horizontal
    assert (given.position is not None) == ("p" in groups)
    assert (given.velocity is not None) == ("v" in groups)
    assert (given.acceleration is not None) == groups.startswith(("a", "pva"))
    assert (request.yaw is None) == (mask & 1024 != 0)


@pytest.mark.parametrize("mask", [0x09FF, 0x05FF, 0x0FFF])
def test_yaw_alone_commands_no_motion_and_is_refused(mask):
    with pytest.raises(RefusedSetpoint, match="no horizontal command"):
        understand(local(mask))


@pytest.mark.parametrize("frame", [0, 2, 3, 4, 5, 6, 10, 11, 13, 20, 21, 255])
def test_other_frames_are_refused_by_name(frame):
    with pytest.raises(RefusedSetpoint, match=f"coordinate_frame {frame} "):
        understand(local(0x0C00, frame))


@pytest.mark.parametrize("mask", [4096 | 0x0C00, 8192 | 0x0C00, 12288, 16384])
def test_the_kinds_of_a_fixed_wing_are_refused(mask):
    with pytest.raises(RefusedSetpoint, match="mean nothing to a multirotor"):
        understand(local(mask))


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1e30])
@pytest.mark.parametrize("field", ["x", "y", "z", *MOTION])
def test_no_number_that_is_used_may_be_wild(field, value):
    with pytest.raises(RefusedSetpoint, match="not finite or too large"):
        understand(local(0, **{field: value}))


def test_a_number_that_is_ignored_may_be_anything():
    message = local(0x0DF8, vx=math.nan, afz=math.inf, yaw=math.nan, yaw_rate=1e30)
    request = understand(message)
    assert request.horizontal.position == (3.0, -4.0)
    assert request.yaw is request.yaw_rate is None


@pytest.mark.parametrize("frame", [BODY, BODY_OFFSET, BODY_FRD])
def test_a_yaw_in_a_body_frame_counts_as_the_autopilot_counts_it(frame):
    mask = 0x0DC7 & ~1024
    assert understand(local(mask, frame)).yaw == pytest.approx(YAW)
    assert understand(local(mask, frame), ardupilot=True).yaw == pytest.approx(YAW + HEADING)
    assert understand(local(mask), ardupilot=True).yaw == pytest.approx(YAW)


@pytest.mark.parametrize("target", [(0, 0), (1, 0), (1, 1), (1, 191)])
def test_a_setpoint_for_us_is_taken(target):
    assert isinstance(understand(local(0x0C00, target=target)), MotionRequest)


@pytest.mark.parametrize("target", [(2, 1), (2, 0), (255, 1), (1, 2), (1, 100)])
def test_a_setpoint_for_somebody_else_is_refused(target):
    with pytest.raises(RefusedSetpoint, match="target_"):
        understand(local(0x0C00, target=target))


def place(mask, frame, latitude, longitude, altitude):
    return dialect.MAVLink_set_position_target_global_int_message(
        0, 1, 1, frame, mask, round(latitude * 1e7), round(longitude * 1e7), altitude, **MOTION
    )


@pytest.mark.parametrize("frame", [0, 3, 5, 6])
@pytest.mark.parametrize(("north", "east"), [(0.0, 0.0), (300.0, -400.0), (-1000.0, 1000.0)])
def test_a_place_on_the_globe(frame, north, east):
    metres = 2.0 * math.pi * 6_371_000.0 / 360.0
    latitude = 47.4 + north / metres
    longitude = 8.5 + east / (metres * math.cos(math.radians(47.4)))
    request = understand(place(0x0DF8, frame, latitude, longitude, 460.0))
    assert request.horizontal.position == pytest.approx((north, east), abs=0.02)
    down = 450.0 - (460.0 if frame in (0, 5) else 440.0 + 460.0)
    assert request.vertical.position == pytest.approx((down,))


@pytest.mark.parametrize("frame", [5, 6])
def test_every_mask_in_a_global_frame(frame):
    for mask in range(4096):
        try:
            request = understand(place(mask, frame, 47.4, 8.5, 460.0))
        except RefusedSetpoint:
            assert not is_documented(mask, LOCAL), mask
        else:
            assert is_documented(mask, LOCAL), mask
            velocity = None if mask & 8 else VELOCITY[:2]
            assert request.horizontal.velocity == velocity


def test_across_the_date_line_the_short_way_counts():
    here = VehiclePose(HERE, HEADING, Origin(0.0, 179.9999, 0.0, 0.0))
    request = understand(place(0x0DF8, 5, 0.0, -179.9999, 5.0), pose=here)
    assert request.horizontal.position == pytest.approx((0.0, 22.24), abs=0.02)


@pytest.mark.parametrize("frame", [10, 11])
def test_terrain_is_not_known(frame):
    with pytest.raises(RefusedSetpoint, match="terrain"):
        understand(place(0x0DF8, frame, 47.4, 8.5, 10.0))


def test_a_place_before_the_origin_is_known_is_refused_but_a_velocity_is_not():
    nowhere = VehiclePose(HERE, HEADING)
    with pytest.raises(RefusedSetpoint, match="global position is not known"):
        understand(place(0x0DF8, 5, 47.4, 8.5, 460.0), pose=nowhere)
    assert understand(place(0x0DC7, 5, 0.0, 0.0, 0.0), pose=nowhere).vertical.velocity


def test_a_place_on_another_continent_is_refused():
    with pytest.raises(RefusedSetpoint, match="from the local origin"):
        understand(place(0x0DF8, 5, 0.0, 0.0, 460.0))


Q = (math.cos(0.1), math.sin(0.1), 0.0, 0.0)


def attitude(mask, q=Q, rates=(0.1, 0.2, 0.3), thrust=0.5):
    return dialect.MAVLink_set_attitude_target_message(0, 1, 1, mask, q, *rates, thrust)


def test_every_mask_of_an_attitude_target():
    """Attitude and thrust (perhaps with a yaw rate), or three body rates and thrust: no other."""
    kinds = {7: "attitude", 3: "attitude, yaw rate", 128: "rates"}
    for mask in range(256):
        if mask not in kinds:
            with pytest.raises(RefusedSetpoint, match=r"^.{10,100}$"):
                understand(attitude(mask))
            continue
        request = understand(attitude(mask))
        if kinds[mask] == "rates":
            assert request == RatesRequest(pytest.approx((0.1, 0.2, 0.3)), 0.5)
        else:
            feed_forward = 0.3 if "rate" in kinds[mask] else 0.0
            assert request == AttitudeRequest(
                pytest.approx(Q), pytest.approx(feed_forward), pytest.approx(0.5)
            )


@pytest.mark.parametrize("thrust", [math.nan, math.inf, -0.01, 1.01])
@pytest.mark.parametrize("mask", [7, 128])
def test_a_wild_thrust_is_refused(mask, thrust):
    with pytest.raises(RefusedSetpoint, match="thrust is outside"):
        understand(attitude(mask, thrust=thrust))


@pytest.mark.parametrize(
    "q", [(0.0, 0.0, 0.0, 0.0), (math.nan, 0.0, 0.0, 0.0), (2.0, 0.0, 0.0, 0.0), (1.0, 0.1, 0, 0)]
)
def test_what_is_no_attitude_is_refused_where_it_is_used(q):
    with pytest.raises(RefusedSetpoint, match="unit quaternion"):
        understand(attitude(7, q=q))
    assert isinstance(understand(attitude(128, q=q)), RatesRequest)


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("value", [math.nan, -math.inf, 1e4])
def test_a_wild_rate_is_refused_where_it_is_used(axis, value):
    rates = [0.1, 0.2, 0.3]
    rates[axis] = value
    with pytest.raises(RefusedSetpoint, match="body rate"):
        understand(attitude(128, rates=rates))
    assert isinstance(understand(attitude(7, rates=rates)), AttitudeRequest)


def test_the_origin_is_averaged_across_the_date_line():
    """A vehicle in Fiji flies to and fro over 180° of longitude: the origin stays where it is."""
    estimate, metre = OriginEstimate(), math.degrees(1.0 / (EARTH_RADIUS * math.cos(0.3)))
    estimate.note((0.0, 0.0, 0.0), math.degrees(0.3), 180.0 - 5.0 * metre, 100.0, 0.0)
    for east in (10.0, -10.0) * 5:
        longitude = (180.0 + (east - 5.0) * metre + 180.0) % 360.0 - 180.0
        estimate.note((0.0, east, 0.0), math.degrees(0.3), longitude, 100.0, 0.0)
        assert estimate.origin.longitude == pytest.approx(180.0 - 5.0 * metre, abs=1e-3 * metre)


def test_a_home_that_is_set_elsewhere_counts_at_once():
    """Its altitude was averaged over 4 s: "2 m above home" after arming on a roof was inside."""
    estimate = OriginEstimate()
    for home in (488.0, 498.0):
        for _ in range(3):
            estimate.note((0.0, 0.0, -5.0), 47.0, 8.0, 493.0, 493.0 - home)
        assert estimate.origin.home_altitude == pytest.approx(home)
        assert estimate.origin.altitude == pytest.approx(488.0)
