"""When a measured dead time is told to differ from the configured one, and what is said then."""

import pytest

from companion.recording.measurements.dead_time import AxisDeadTime, DeadTimes


@pytest.mark.parametrize(
    ("measured", "configured", "wrong"),
    [
        (0.040, 0.040, False),
        (0.051, 0.040, False),
        (0.053, 0.040, True),
        (0.029, 0.040, False),
        (0.027, 0.040, True),
        (0.0225, 0.015, False),  # 60 % off, but that much depends on what is flown
        (0.026, 0.015, True),
        (0.012, 0.0, True),
        (None, 0.040, False),
        (0.080, None, False),
    ],
)
def test_30_percent_beyond_doubt_is_wrong(measured, configured, wrong):
    assert AxisDeadTime(measured, configured).is_wrong is wrong


def test_the_warning_names_the_axes_the_times_and_what_to_do():
    right, wrong, unknown = AxisDeadTime(0.042, 0.04), AxisDeadTime(0.081, 0.04), AxisDeadTime()
    warning = DeadTimes({"roll": right, "pitch": wrong, "yaw": unknown}).warning()
    assert "pitch 81 ms (configured 40 ms)" in warning
    assert "roll" not in warning
    assert "yaw" not in warning
    assert "`companion identify`" in warning


def test_nothing_is_said_of_what_is_as_configured_or_was_not_measured():
    assert DeadTimes().warning() is None
    assert DeadTimes({"roll": AxisDeadTime(0.042, 0.04)}).warning() is None
