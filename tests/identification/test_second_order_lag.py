"""The second-order loop's exact response and decay, against SciPy's simulation of its equation."""

import numpy as np
import pytest

from companion.identification.lags import (
    held_commands,
    second_order_free_responses,
    second_order_response,
    slew_limited,
    value_at,
)

LOOPS = [(6.0, 0.44), (19.6, 0.73), (10.0, 1.0), (10.0, 1.0 + 1e-9), (8.0, 1.3), (60.0, 3.0)]


def simulated(*arguments, **options):
    """The answer of a loop by SciPy, whose import takes a second: collecting does without."""
    from scipy.signal import lsim  # noqa: PLC0415

    return lsim(*arguments, **options)[1]


@pytest.mark.parametrize("slew", [None, 3.0])
@pytest.mark.parametrize(("frequency", "damping"), LOOPS)
def test_it_answers_as_its_equation_says(frequency, damping, slew):
    rng = np.random.default_rng(1)
    commands = held_commands(np.cumsum(rng.integers(50, 300, size=30)) * 1e-3, rng.normal(size=30))
    if slew is not None:
        commands = slew_limited(commands, slew)
    at = np.arange(commands.time[0], commands.time[-1] + 1.0, 5e-4)
    asked = value_at(commands, at + 1e-9)  # each step between two samples, as lsim holds it
    loop = [frequency**2], [1.0, 2.0 * damping * frequency, frequency**2]
    scipys = simulated(loop, asked - asked[0], at - at[0], interp=slew is not None)
    answered = second_order_response(commands, frequency, damping, at)
    np.testing.assert_allclose(answered, scipys + asked[0], rtol=0.0, atol=2e-3, strict=True)


@pytest.mark.parametrize(("frequency", "damping"), LOOPS)
def test_what_it_began_with_dies_away_by_the_two_columns_whatever_it_was(frequency, damping):
    since = np.linspace(0.0, 1.0, 500)
    state = np.array([[0.0, 1.0], [-(frequency**2), -2.0 * damping * frequency]])
    loop = state, np.zeros((2, 1)), np.eye(2)[:1], np.zeros((1, 1))
    dying = simulated(loop, np.zeros(500), since, X0=[0.7, -3.0])
    columns = second_order_free_responses(since, frequency, damping)
    weights, *_ = np.linalg.lstsq(columns, dying, rcond=None)
    assert columns @ weights == pytest.approx(dying, abs=1e-5)
