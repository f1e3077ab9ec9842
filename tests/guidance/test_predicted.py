"""The predicted motion of a maneuver: its reference, or what its open-loop commands cause."""

from math import exp, pi, tan

import pytest

from companion.attitude import BodyRates, Coefficients
from companion.drag import Drag
from companion.guidance import GRAVITY, Reference
from companion.guidance.predicted import predict
from companion.guidance.reference import HorizontalMode, TiltCommand


class Part:
    """A maneuver with one command from its beginning to `until`, and its reference afterwards."""

    name, duration = "part", 4.0

    def __init__(self, command=HorizontalMode.POSITION, until=2.0):
        self.until, self.command = until, command

    def check_times(self):
        return [0.01 * k for k in range(401)]

    def at(self, time, start):
        north, east, down = start.position_ned
        pushed = (0.1 + start.heading, 0.2, 0.3)
        plain = Reference((north + time, east + 2.0, down - 3.0), (1.0, 0.0, 0.5), pushed)
        return plain._replace(horizontal=self.command) if time < self.until else plain


def moment(time, part, **options):
    return next(each for each in predict(part, **options) if each.time >= time - 1e-9)


def test_in_closed_loop_it_is_the_reference():
    found = moment(3.0, Part())
    assert found == (3.0, (3.0, 2.0, -3.0), (1.0, 0.0, 0.5), (0.1, 0.2, 0.3))
    assert moment(3.0, Part(), heading=0.5).acceleration == (0.6, 0.2, 0.3)


def test_a_coefficient_accelerates_from_rest_and_the_height_is_the_references():
    found = moment(1.99, Part(TiltCommand(Coefficients(0.6, 0.0))))
    a = GRAVITY * 0.6 / 0.8
    assert found.acceleration == pytest.approx((a, 0.0, 0.3))
    assert found.velocity == pytest.approx((1.99 * a, 0.0, 0.5))
    assert found.offset == pytest.approx((0.5 * a * 1.99**2, 0.0, -3.0))
    east = moment(1.99, Part(TiltCommand(Coefficients(0.0, -0.6))))
    assert east.offset[:2] == pytest.approx((0.0, -0.5 * a * 1.99**2))


def test_a_coefficient_beyond_one_is_no_error():
    assert moment(1.0, Part(TiltCommand(Coefficients(1.0, 0.5)))).velocity[0] > 0.0


def test_afterwards_it_is_the_reference_again_and_the_next_step_begins_at_rest():
    part = Part(TiltCommand(Coefficients(0.6, 0.0)))
    assert moment(2.5, part).offset == (2.5, 2.0, -3.0)
    part.at = lambda time, start, at=part.at: at(time % 2.5, start)
    assert moment(3.0, part).velocity[0] == pytest.approx(0.5 * GRAVITY * 0.75, rel=0.05)
    turned = Part(BodyRates(0.3, 0.0, 0.0))
    turned.at = lambda time, start, at=turned.at: at(time % 2.5, start)
    assert moment(3.0, turned, heading=pi / 2.0).velocity[0] < -0.3  # to the right: south


@pytest.mark.parametrize(
    ("rates", "heading", "direction"),
    [
        (BodyRates(0.0, -0.3, 0.0), 0.0, (1.0, 0.0)),
        (BodyRates(0.3, 0.0, 0.0), 0.0, (0.0, 1.0)),
        (BodyRates(0.0, -0.3, 0.0), pi / 2.0, (0.0, 1.0)),
        (BodyRates(0.3, 0.0, 0.0), pi / 2.0, (-1.0, 0.0)),
    ],
)
def test_body_rates_tilt_and_the_tilt_accelerates(rates, heading, direction):
    found = moment(1.0, Part(rates), heading=heading)
    a = GRAVITY * tan(0.3)
    assert found.acceleration[:2] == pytest.approx((a * direction[0], a * direction[1]), abs=1e-9)
    assert abs(sum(found.offset[:2])) == pytest.approx(GRAVITY * 0.3 / 6.0, rel=0.05)


def test_the_predicted_tilt_has_a_limit():
    found = moment(1.9, Part(BodyRates(3.0, 3.0, 0.0)))
    a = GRAVITY * tan(1.4)
    assert found.acceleration[:2] == pytest.approx((-a, a))
    found = moment(1.9, Part(BodyRates(-3.0, -3.0, 0.0)))
    assert found.acceleration[:2] == pytest.approx((a, -a))


def test_drag_slows_it():
    """v' = a − d·v: after 2 s the speed is a/d·(1 − e^(−2d))."""
    found = moment(1.99, Part(TiltCommand(Coefficients(0.36, 0.48))), drag=Drag(0.5, 0.0))
    a = GRAVITY * 0.75
    speed = 2.0 * a * (1.0 - exp(-0.995))
    assert found.velocity[:2] == pytest.approx((0.6 * speed, 0.8 * speed), rel=0.01)
    assert found.acceleration[:2] == pytest.approx((0.6 * a, 0.8 * a))
