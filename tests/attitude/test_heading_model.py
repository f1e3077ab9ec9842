"""The planned heading and the foreseen turn of the body against numerical integration."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from companion.attitude import Limits, Target
from companion.attitude.limits import make_constants
from companion.attitude.rate_response import AxisResponse, RateLoopResponse
from companion.attitude.yaw import HeadingModel, YawModel

UNLIMITED = Limits()


def heading_model(limits=UNLIMITED, lag=0.075, acceleration=np.inf, yaw_gain=2.0):
    model = HeadingModel(
        make_constants(5.0, yaw_gain, limits), AxisResponse(lag, 0.1, acceleration)
    )
    model.start_at(0.3, 0.0)
    return model


def moved(model, heading, seconds, dt):
    """(S + 1, 2): heading, turn rate."""
    rows = [(model.heading, model.turn_rate)]
    for _ in range(round(seconds / dt)):
        model.advance(Target(0.0, 0.0, heading), dt)
        rows.append((model.heading, model.turn_rate))
    return np.array(rows)


def test_the_heading_is_its_differential_equation_sampled():
    rows = moved(heading_model(), 1.3, 3.0, 0.002)
    solved = solve_ivp(
        lambda _, s: [s[1], (2.0 * (1.3 - s[0]) - s[1]) / 0.075],
        (0.0, 3.0),
        [0.3, 0.0],
        t_eval=np.linspace(0.0, 3.0, len(rows)),
        rtol=1e-9,
    )
    assert rows == pytest.approx(solved.y.T, abs=4e-3)  # v is held over each sample


def test_it_takes_the_short_way_round():
    assert moved(heading_model(), 0.3 + 4.0, 4.0, 0.01)[-1, 0] == pytest.approx(
        0.3 + 4.0 - 2.0 * np.pi, abs=2e-3
    )


def test_a_turning_target_is_followed_without_error():
    model = heading_model()
    for n in range(1000):
        model.advance(Target(0.0, 0.0, 0.3 + 0.005 * n, 0.5), 0.01)
    assert model.heading == pytest.approx(0.3 + 5.0, abs=5e-3)
    assert model.turn_rate == pytest.approx(0.5, abs=1e-6)


def test_it_turns_no_faster_than_the_limit():
    rows = moved(heading_model(Limits(max_yaw_rate=0.8)), 2.8, 6.0, 0.01)
    assert rows[:, 1].max() == pytest.approx(0.8, rel=1e-3)
    assert rows[-1, 0] == pytest.approx(2.8, abs=1e-3)


@pytest.mark.parametrize("yaw_gain", [2.0, 6.0])
def test_it_needs_no_more_acceleration_than_the_autopilot_allows(yaw_gain):
    lag, dt, most = 0.06, 0.004, 4.7
    rows = moved(heading_model(lag=lag, acceleration=most, yaw_gain=yaw_gain), 2.8, 6.0, dt)
    turn = rows[:, 1]
    led = 0.5 * (turn[1:] + turn[:-1]) + lag * np.diff(turn) / dt
    change = np.abs(np.diff(led)) / dt
    assert 0.9 * most <= change.max() <= 1.1 * most
    assert rows[:, 0].max() <= 2.8 + 0.03
    assert rows[-1, 0] == pytest.approx(2.8, abs=2e-3)


@pytest.mark.parametrize("most", [np.inf, 4.7])
def test_the_body_turns_as_limit_and_lag_make_it(most):
    """Against an integration in steps of 10 µs; commands at 250 Hz."""
    lag, rng = 0.064, np.random.default_rng(3)
    commands = np.repeat(rng.uniform(-1.0, 1.0, 25), 20)
    model = YawModel(AxisResponse(lag, 0.1, most))
    model.start(0.2)
    aimed = rate = 0.2
    turned = 0.0
    for command in commands.tolist():
        model.advance(command, 0.004)
        for _ in range(400):
            aimed += min(max(command - aimed, -most * 1e-5), most * 1e-5)
            turned += rate * 1e-5
            rate += (aimed - rate) / lag * 1e-5
        assert model.rate == pytest.approx(rate, abs=2e-2 if most < 5.0 else 1e-3)
        assert model.yaw_angle == pytest.approx(turned, abs=3e-3)


@pytest.mark.parametrize(
    ("axes", "named"),
    [
        ({"roll": AxisResponse(lag=-0.001)}, "lag must be from 0 to 1 s, not -0.001"),
        ({"yaw": AxisResponse(lag=np.nan)}, "yaw_lag must"),
        ({"pitch": AxisResponse(lag=2.0)}, "pitch_lag must"),
        ({"pitch": AxisResponse(acceleration=-1.0)}, "pitch_acceleration must be at least 1e-06"),
        ({"yaw": AxisResponse(dead_time=1.5)}, "yaw_dead_time must"),
        ({"roll": AxisResponse(acceleration=0.0)}, "acceleration must be at least 1e-06, not 0.0"),
        ({"yaw": AxisResponse(acceleration=np.nan)}, "yaw_acceleration must be at least 1e-06"),
        ({"roll": AxisResponse(acceleration=1e-300)}, "acceleration must be at least 1e-06"),
        ({"roll": AxisResponse(damping=0.0)}, "damping must be at least 1e-06, not 0.0"),
        ({"pitch": AxisResponse(damping=np.nan)}, "pitch_damping must be at least 1e-06"),
        ({"frame_lead": -0.1}, "frame_lead must"),
    ],
)
def test_an_impossible_response_is_refused(axes, named):
    with pytest.raises(ValueError, match=f"^{named}"):
        RateLoopResponse(**axes)
