"""The linear model of the loop against the program's own code: by frequency, and by oscillating."""

from collections import deque
from math import cos, sin

import numpy as np
import pytest

from companion.attitude import BodyRates
from companion.config.files import changed, load, shipped
from companion.control.guidance_command import GuidanceCommand
from companion.control.inner_loop import planner, tilt_lag_and_dead_time
from companion.control.outer_loop import make_guidance, motion_estimate
from companion.guidance import GRAVITY, Reference
from companion.tuning import loop as loop_module
from companion.tuning.loop import ModelMismatch, control_loop
from companion.tuning.margins import frequencies, margins
from companion.vehicle.records import AttitudeSample, LocalPosition
from tests.control.one_axis import DT, Airframe, hold

HELD = Reference((0.0, 0.0, -5.0))
DRAG = 0.6
SMALL = 0.01  # rad


def configured(name, gain, **guidance):
    told = {"drag_per_s": DRAG, **guidance}
    return changed(
        load(shipped(f"{name}.yaml")), {"planner": {"gain_per_s": gain}, "guidance": told}, "test"
    )


CONFIGS = {
    "px4": configured("px4", 5.0),
    "ardupilot": configured("ardupilot", 8.0, disturbance_bandwidth_rad_s=8.0),
    "soft": configured(
        "px4",
        3.0,
        position_weight_per_s4=16.0,
        velocity_weight_per_s2=4.0,
        disturbance_bandwidth_rad_s=9.0,
    ),
}


@pytest.fixture(autouse=True)
def known_lateness(monkeypatch):
    """Positions of `tests.control.one_axis` are no later than their time stamp says."""
    monkeypatch.setattr(loop_module, "UNSTAMPED_POSITION_DELAY", 0.0)


def measured(config, omega):
    """Body rate commanded per roll angle, (−rad/s)/rad, while the vehicle rolls to and fro."""
    law, guidance = planner(config), make_guidance(config)
    estimate = motion_estimate(config, lambda: 0.0)
    told, period = deque(maxlen=4), 2.0 * np.pi / omega
    begin, command, rows = 4.0, None, []
    for n in range(round((begin + max(2.0, 2.0 * period)) / DT)):
        time = n * DT
        angle = SMALL * np.exp(1j * omega * time)
        speed = GRAVITY * angle / (1j * omega + DRAG)
        roll, rate = angle.imag, (1j * omega * angle).imag
        q, rates = (cos(0.5 * roll), sin(0.5 * roll), 0.0, 0.0), BodyRates(rate, 0.0, 0.0)
        estimate.note_attitude(AttitudeSample(0, time, time, 0, q, rates))
        told.append((time, (speed / (1j * omega)).imag, speed.imag))
        if n % 5 == 0:
            at, east, fast = told[0]
            position = LocalPosition(time, at, (0.0, east, -5.0), (0.0, fast, 0.0))
            estimate.note_position(position, offboard_active=False)
            inputs = estimate.guidance_input(time, guidance.effect_delay, (2.0, 18.0))
            target, later, down = guidance.command(lambda _: HELD, time, inputs)
            command = GuidanceCommand(target, down, time, later_target=later, period=5 * DT)
        answer = law.rates(q, command.target_at(time), DT, rates).roll
        if time >= begin:
            rows.append((sin(omega * time), cos(omega * time), 1.0, answer))
    rows = np.array(rows)
    (real, imaginary, _), *_ = np.linalg.lstsq(rows[:, :3], rows[:, 3], rcond=None)
    return -(real + 1j * imaginary) / SMALL


@pytest.mark.parametrize("name", CONFIGS)
@pytest.mark.parametrize("omega", [2.0, 6.0, 14.0])
def test_guidance_and_planner_answer_as_the_formulas_say(name, omega):
    loop = control_loop(CONFIGS[name], np.array([1j * omega]))
    ratio = measured(CONFIGS[name], omega) / (loop.gain_at_rate / loop.rate_response)[0]
    # The vehicle holds the rates for half a sample, which the sinusoid does not.
    ratio *= np.exp(-0.5j * omega * DT)
    assert abs(ratio) == pytest.approx(1.0, abs=0.02)
    assert np.degrees(np.angle(ratio)) == pytest.approx(0.0, abs=1.0)


def growth(config, **vehicle):
    """Standard deviation of the position after 6 s, per that before."""
    lag, dead_time = tilt_lag_and_dead_time(config)
    late, damping = vehicle.pop("late", 0.0), config.vehicle.axes["roll"].damping
    flown = Airframe(lag, dead_time + late, DRAG, damping=damping, **vehicle)
    places = hold(config, flown, seconds=10.0, off=0.02)
    second, last = places[500:1000], places[-500:]
    return np.inf if not np.isfinite(places).all() else last.std() / second.std()


@pytest.mark.parametrize("name", ["px4", "ardupilot"])
def test_it_begins_to_oscillate_at_the_predicted_margins(name):
    s = frequencies()
    found = margins(s, control_loop(CONFIGS[name], s).gain_at_rate)
    assert found.stable
    assert growth(CONFIGS[name], rate_gain=10 ** ((found.gain_db - 1.2) / 20.0)) < 0.5
    assert growth(CONFIGS[name], rate_gain=10 ** ((found.gain_db + 1.2) / 20.0)) > 0.5
    assert growth(CONFIGS[name], late=found.delay - 0.008) < 0.5
    assert growth(CONFIGS[name], late=found.delay + 0.008) > 0.5


@pytest.mark.parametrize("name", ["px4", "ardupilot"])
def test_beyond_the_margins_the_model_is_unstable(name):
    s, config = frequencies(), CONFIGS[name]
    found = margins(s, control_loop(config, s).gain_at_rate)
    for share, stable in ((0.95, True), (1.05, False)):
        gain = 10 ** (share * found.gain_db / 20.0)
        errors = ModelMismatch(gain=gain), ModelMismatch(delay=share * found.delay)
        for error in errors:
            assert margins(s, control_loop(config, s, error).gain_at_rate).stable == stable
