"""A request worked off: planned from when and where its answer acts."""

from dataclasses import replace
from math import radians

import pytest

from companion.attitude import BodyRates, Coefficients, attitude
from companion.drag import Drag
from companion.guidance.trajectory.figures import Hover, Laps, circle
from companion.nmpc import ControlInput, Request, Settings, Start, Status, VehicleSnapshot
from companion.nmpc.reference import node_of
from companion.nmpc.worker import Worker

DRAG = Drag(0.6, 0.08)
CIRCLE = circle(5.0, Laps(5.0, laps=4.0))
SETTINGS = Settings(dead_time=0.2, lead=0.04, max_tilt=0.9, iterations=20)
STILL = BodyRates(0.0, 0.0, 0.0)


def wanted(at):
    """The target that keeps a first-order response on the circle, and its thrust."""
    node = node_of(CIRCLE.at(at), Start((0.0, 0.0, 0.0)), 0.0, DRAG, 0.0, 9.80665, (0.0, 0.0, 0.0))
    led = node.north + node.speed_north / 5.0, node.east + node.speed_east / 5.0
    return node, led


def test_it_plans_for_when_the_answer_acts_on_where_the_vehicle_is_then():
    """On the circle, everything as it ought to be; in dead time and lead it goes on by 14°."""
    at = 6.0
    node, _ = wanted(at)
    inputs = []
    for k in range(30, 0, -1):
        _, led = wanted(at - 0.02 * k + SETTINGS.dead_time)
        inputs.append(ControlInput(-0.02 * k, *led, 0.0, node.thrust))
    q = attitude(Coefficients(node.north, node.east), 0.0)
    # At the speed that its coefficients have on the circle: these body rates, by differences.
    later = attitude(Coefficients(wanted(at + 1e-4)[0].north, wanted(at + 1e-4)[0].east), 0.0)
    w, x, y, z = q
    turn = (
        w * later[1] - x * later[0] - y * later[3] + z * later[2],
        w * later[2] - y * later[0] - z * later[1] + x * later[3],
        w * later[3] - z * later[0] - x * later[2] + y * later[1],
    )
    rates = BodyRates(*(2.0 * v / 1e-4 for v in turn))
    vehicle = VehicleSnapshot(0.0, node.position, node.velocity, q, rates, drag=DRAG)
    start = Start((0.0, 0.0, 0.0))
    answer = Worker(SETTINGS, CIRCLE).answer(Request(1, vehicle, at, start, tuple(inputs)))
    assert answer.status is Status.SOLVED
    assert answer.time == SETTINGS.lead
    _, led = wanted(at + SETTINGS.lead + SETTINGS.dead_time)
    assert (answer.north, answer.east) == pytest.approx(led, abs=0.05)
    _, too_early = wanted(at)
    assert (answer.north, answer.east) != pytest.approx(too_early, abs=0.1)
    assert answer.thrust == pytest.approx(node.thrust, abs=0.3)


def test_tilted_beyond_a_limit_that_it_cannot_return_to_at_once_it_still_plans():
    settings = Settings(max_tilt=0.4, max_tilt_rate=0.5)
    q = attitude(Coefficients(0.7, 0.0), 0.0)
    vehicle = VehicleSnapshot(0.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), q, STILL)
    answer = Worker(settings, Hover(9.0)).answer(
        Request(1, vehicle, 1.0, Start((0.0, 0.0, 0.0)), ())
    )
    assert answer.status is Status.SOLVED
    assert 0.4 < answer.north < 0.7


@pytest.mark.parametrize("turned", [0.0, radians(179.0)])
def test_a_held_heading_is_laid_out_from_the_start_and_found_the_short_way(turned):
    settings = replace(SETTINGS, dead_time=0.0, max_yaw_rate=5.0)
    q = attitude(Coefficients(0.0, 0.0), turned + radians(3.0))
    vehicle = VehicleSnapshot(0.0, (1.0, 2.0, -3.0), (0.0, 0.0, 0.0), q, STILL)
    answer = Worker(settings, Hover(9.0)).answer(
        Request(1, vehicle, 1.0, Start((1.0, 2.0, -3.0), turned), ())
    )
    back = (answer.heading - turned - radians(3.0) + radians(180.0)) % radians(360.0)
    assert -1.0 < back - radians(180.0) < -0.01
    assert -radians(180.0) < answer.heading <= radians(180.0)
    assert (answer.north, answer.east) == pytest.approx((0.0, 0.0), abs=1e-3)


def test_wind_is_leant_against():
    vehicle = VehicleSnapshot(
        0.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), attitude(Coefficients(-0.1, 0.0), 0.0), STILL
    )
    blown = vehicle._replace(disturbance=(0.1 * 9.80665, 0.0, 0.0))
    worker, start = Worker(Settings(), Hover(9.0)), Start((0.0, 0.0, 0.0))
    answer = worker.answer(Request(1, blown, 1.0, start, ()))
    assert answer.north == pytest.approx(-0.1, abs=0.01)
