"""The hover thrust, learned against a vehicle of our own: a mass with lagging rotors and drag."""

import math
import random
from dataclasses import replace

import pytest
from scipy.spatial.transform import Rotation

from companion.attitude import BodyRates
from companion.guidance import GRAVITY, HoverThrust, ThrustSettings

SETTINGS = ThrustSettings(
    hover=0.5, correction_limit=0.8, correction_time=1.5, min_thrust=0.1, max_thrust=0.9
)
LEVEL, STILL = (1.0, 0.0, 0.0, 0.0), BodyRates(0.0, 0.0, 0.0)
STEP = 0.004


class Vehicle:
    """Rises and falls by the thrust it is sent; velocity is measured at 50 Hz with noise."""

    def __init__(self, thrust, hover=0.5, lag=0.05, drag=0.0, noise=0.02, q=LEVEL, curve=0.0):
        self.thrust, self.hover, self.lag, self.drag = thrust, hover, lag, drag
        self.noise, self.q, self.curve = noise, q, curve
        self.divides_by_cos = False
        self.time = self.velocity = self.height_lost = 0.0
        self.felt = GRAVITY
        self.random = random.Random(3)

    def specific(self, signal):
        share = self.curve * signal**2 + (1.0 - self.curve) * signal
        at_hover = self.curve * self.hover**2 + (1.0 - self.curve) * self.hover
        return GRAVITY * share / at_hover

    def cosine(self):
        return 1.0 if self.divides_by_cos else 1.0 - 2.0 * (self.q[1] ** 2 + self.q[2] ** 2)

    def fly(self, seconds, command=lambda vehicle: 1.5 * -vehicle.velocity, push=0.0):
        """Damp the motion, unless told otherwise; `push` is a downward acceleration."""
        for k in range(round(seconds / STEP)):
            if k % 5 == 0:
                self.thrust.observe(self.time, self.velocity + self.random.gauss(0.0, self.noise))
            signal = self.thrust.normalised_thrust(command(self), self.q, STILL)
            self.thrust.note_thrust(signal, self.q)
            self.felt += STEP / self.lag * (self.specific(signal) - self.felt)
            lift = self.felt * self.cosine() + self.drag * self.velocity
            self.velocity += STEP * (GRAVITY - lift + push)
            self.height_lost += STEP * self.velocity
            self.time += STEP
        return self


@pytest.mark.parametrize("true_hover", [0.3, 0.357, 0.5, 0.7, 0.83])
def test_a_configured_hover_thrust_that_is_far_off_is_put_right_at_once(true_hover):
    thrust = HoverThrust(SETTINGS)
    vehicle = Vehicle(thrust, true_hover).fly(0.8)
    assert thrust.learned_hover == pytest.approx(true_hover, rel=0.05)
    assert abs(vehicle.height_lost) < 0.5
    vehicle.fly(4.0)
    assert thrust.learned_hover == pytest.approx(true_hover, rel=0.01)


def test_more_noise_is_believed_less():
    estimates = {}
    for noise in (0.02, 0.2):
        thrust = HoverThrust(SETTINGS)
        vehicle = Vehicle(thrust, noise=noise).fly(6.0)
        estimates[noise] = [vehicle.fly(0.1).thrust.learned_hover for _ in range(100)]
    spread = {noise: max(found) - min(found) for noise, found in estimates.items()}
    assert spread[0.02] < 0.01
    # Ten times the noise: as a fixed gain would have it, the spread would be ten times as large.
    assert spread[0.2] < 6.0 * spread[0.02]


def test_a_slow_change_is_followed_with_the_time_constant():
    thrust = HoverThrust(SETTINGS)
    vehicle = Vehicle(thrust, noise=0.03).fly(10.0)
    rate = 0.01
    for _ in range(1000):
        vehicle.hover += rate * 0.01
        vehicle.fly(0.012)
    behind = (vehicle.hover - thrust.learned_hover) / (rate * 0.01 / 0.012)
    assert 0.5 * SETTINGS.correction_time < behind < 1.5 * SETTINGS.correction_time


def test_a_load_that_is_dropped_is_refused_first_and_learned_soon():
    thrust = HoverThrust(SETTINGS)
    vehicle = Vehicle(thrust, 0.6).fly(8.0)
    vehicle.hover = 0.4
    vehicle.fly(0.12)
    assert thrust.learned_hover == pytest.approx(0.6, rel=0.02)
    vehicle.fly(0.9)
    assert thrust.learned_hover == pytest.approx(0.4, rel=0.05)


def test_a_bump_is_not_learned_from():
    thrust = HoverThrust(SETTINGS)
    vehicle = Vehicle(thrust).fly(8.0)
    vehicle.fly(0.1, push=6.0)
    assert thrust.learned_hover == pytest.approx(0.5, rel=0.02)


def test_neither_free_fall_nor_garbage_is_ever_learned_from():
    thrust = HoverThrust(SETTINGS)
    vehicle = Vehicle(thrust).fly(8.0)
    before = thrust.learned_hover
    for k in range(100):
        thrust.note_thrust(0.5, LEVEL)
        thrust.observe(vehicle.time + 0.05 * k, 0.49 * k)
    for k, velocity in enumerate([math.nan, math.inf, 1e30, -1e30] * 50):
        thrust.note_thrust(0.5, LEVEL)
        thrust.observe(vehicle.time + 6.0 + 0.05 * k, velocity)
    assert thrust.learned_hover == before


def test_a_velocity_older_than_the_last_one_is_not_learned_from():
    thrust = HoverThrust(SETTINGS)
    for time, velocity in ((10.0, 0.0), (9.7, 1.0)):
        thrust.note_thrust(0.5, LEVEL)
        thrust.observe(time, velocity)
    assert thrust.measured_hover == 0.5


def test_an_attitude_upside_down_leads_to_no_negative_hover_thrust():
    thrust = HoverThrust(SETTINGS)
    for k in range(100):
        thrust.note_thrust(1.0, (0.0, 1.0, 0.0, 0.0))
        thrust.observe(0.02 * k, 0.65 * GRAVITY * 0.02 * k)
    assert thrust.measured_hover == pytest.approx(0.5)


@pytest.mark.parametrize(("sent", "bound"), [(0.95, 0.9), (0.25, 0.5 / 1.8)])
def test_a_thrust_that_was_never_flown_by_leads_no_further_than_the_limit(sent, bound):
    thrust = HoverThrust(replace(SETTINGS, max_thrust=1.0))
    for k in range(500):
        thrust.note_thrust(sent, LEVEL)
        thrust.observe(0.02 * k, 0.0)
    assert thrust.learned_hover == pytest.approx(bound)


def test_after_a_lie_the_truth_is_learned():
    """An autopilot that tells its thrust in other units costs half a second, no more."""
    thrust = HoverThrust(SETTINGS)
    for k in range(500):
        thrust.note_thrust(0.8, LEVEL)
        thrust.observe(0.02 * k, 0.0)
    assert thrust.learned_hover == pytest.approx(0.8, rel=0.02)
    vehicle = Vehicle(thrust)
    vehicle.time = 10.0
    vehicle.fly(1.0)
    assert thrust.learned_hover == pytest.approx(0.5, rel=0.06)


def test_nothing_is_learned_across_a_pause_a_gap_or_the_ground():
    thrust = HoverThrust(SETTINGS)
    for interruption in (thrust.pause, thrust.on_ground):
        thrust.observe(0.0, 0.0)
        thrust.note_thrust(0.9, LEVEL)
        interruption()
        thrust.observe(0.2, 0.0)
        interruption()
    thrust.observe(1.0, 0.0)
    thrust.note_thrust(0.9, LEVEL)
    thrust.observe(9.0, 0.0)
    assert thrust.learned_hover == 0.5
    thrust.note_thrust(0.9, LEVEL)
    thrust.observe(9.2, 0.0)  # the same without any of them
    assert thrust.learned_hover > 0.6


def test_a_thrust_that_nobody_noted_is_not_learned_from():
    thrust = HoverThrust(SETTINGS)
    for k in range(100):
        thrust.observe(0.1 * k, 1.0 * k)
    assert thrust.learned_hover == 0.5


def test_known_drag_is_not_taken_for_thrust():
    wrong, right = HoverThrust(SETTINGS), HoverThrust(replace(SETTINGS, drag=1.0))
    for thrust in (wrong, right):
        Vehicle(thrust, drag=1.0).fly(4.0, command=lambda vehicle: -2.0 - vehicle.velocity)
    assert right.learned_hover == pytest.approx(0.5, rel=0.02)
    assert wrong.learned_hover > 0.53


def test_drag_that_is_not_known_makes_a_climb_doubtful():
    thrust = HoverThrust(SETTINGS)
    vehicle = Vehicle(thrust, drag=0.5).fly(6.0)
    vehicle.fly(2.5, command=lambda v: 2.0 * (-2.0 - v.velocity))
    assert vehicle.velocity < -1.5
    # Taken at its word, the drag of 0.8 m/s² would have moved it by 6 % in this time.
    assert thrust.learned_hover == pytest.approx(0.5, rel=0.04)


def test_tilt_is_divided_out_by_us_or_by_the_autopilot():
    w, x = math.cos(0.3), math.sin(0.3)  # 34°
    for compensated in (False, True):
        thrust = HoverThrust(replace(SETTINGS, tilt_compensated=compensated))
        vehicle = Vehicle(thrust, q=(w, x, 0.0, 0.0))
        vehicle.divides_by_cos = compensated
        assert abs(vehicle.fly(5.0).velocity) < 0.05
        assert thrust.learned_hover == pytest.approx(0.5, rel=0.01)
        signal = thrust.normalised_thrust(0.0, vehicle.q, STILL)
        assert signal == pytest.approx(0.5 if compensated else 0.5 / math.cos(0.6), rel=0.01)


def test_a_lag_that_is_known_leads_the_thrust_as_the_vehicle_tilts():
    q = Rotation.from_rotvec((0.5, 0.0, 0.0)).as_quat(scalar_first=True)
    rolling = BodyRates(2.0, 0.0, 0.0)
    plain, led = HoverThrust(SETTINGS), HoverThrust(replace(SETTINGS, lag=0.05))
    assert plain.normalised_thrust(0.0, q, rolling) == pytest.approx(0.5 / math.cos(0.5))
    assert led.normalised_thrust(0.0, q, rolling) == pytest.approx(0.5 / math.cos(0.6), rel=0.01)


def test_through_a_curved_thrust_the_motion_is_as_wanted():
    for known, error in ((0.6, 0.02), (0.0, 0.25)):
        thrust = HoverThrust(replace(SETTINGS, curve_factor=known))
        vehicle = Vehicle(thrust, hover=0.4, curve=0.6, noise=0.005).fly(5.0)
        assert thrust.learned_hover == pytest.approx(0.4, rel=0.02)
        signal = thrust.normalised_thrust(-4.0, LEVEL, STILL)
        off = abs(vehicle.specific(signal) - GRAVITY - 4.0) / 4.0
        assert off < error if known else off > error


def test_the_battery_is_made_up_for_at_once():
    thrust = HoverThrust(replace(SETTINGS, battery_exponent=2.0))
    thrust.note_voltage(1.0, 16.0)
    for k in range(20):
        thrust.note_voltage(2.0 + k, 14.4)
    assert thrust.normalised_thrust(0.0, LEVEL, STILL) == pytest.approx(0.5 / 0.81, rel=1e-3)
    assert thrust.learned_hover == 0.5
    assert thrust.largest_specific_thrust == pytest.approx(0.9 / 0.5 * GRAVITY * 0.81, rel=1e-3)
    thrust.on_ground()
    assert thrust.normalised_thrust(0.0, LEVEL, STILL) == 0.5


def test_a_sag_that_the_voltage_tells_is_not_learned_a_second_time():
    thrust = HoverThrust(replace(SETTINGS, battery_exponent=2.0))
    for k in range(60):
        thrust.note_voltage(0.1 * k, 16.0 - 0.02 * k)
        thrust.note_thrust(0.5 * (16.0 / (16.0 - 0.02 * k)) ** 2, LEVEL)
        thrust.observe(0.1 * k, 0.0)
    assert thrust.learned_hover == pytest.approx(0.5, rel=0.01)


def test_what_is_given_out_stays_in_its_bounds():
    thrust = HoverThrust(SETTINGS)
    assert thrust.normalised_thrust(-1e9, LEVEL, STILL) == 0.9
    assert thrust.normalised_thrust(1e9, LEVEL, STILL) == 0.1
    assert thrust.smallest_specific_thrust == pytest.approx(0.2 * GRAVITY)
    assert thrust.largest_specific_thrust == pytest.approx(1.8 * GRAVITY)
