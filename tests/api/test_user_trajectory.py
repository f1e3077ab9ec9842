"""A trajectory of a program that fails in flight: whose error it is, and who has the vehicle."""

import asyncio
from math import nan
from pathlib import Path

import pytest

import companion
from companion.guidance.trajectory import Sample, TrajectoryError, evenly_slowed, line
from companion.guidance.trajectory.own_trajectory import UserTrajectory, checked_trajectory
from companion.testing import connect, run
from companion.user_code import MESSAGE_START, UserCodeError, naming_user_code
from tests.flight.fly import OTHER_VEHICLES, QUICK_FLIGHT, QuickVehicle, merged


class Ahead:
    """Flies 4 m north in some 4 s; from 1 s on it does what `does` says."""

    name, holds_heading = "ahead", True

    def __init__(self):
        self.path, self.does = line((4.0, 0.0, 0.0), 2.0, 2.0, 4.0), None
        self.duration, self.check_times = self.path.duration, self.path.check_times

    def at(self, time):
        sample = self.path.at(time)
        return sample if self.does is None or time < 1.0 else self.does(sample)


def raising(error):
    def does(_):
        raise error

    return does


def result_of(autopilot, made, own, does):
    """Why the flight along `made` ended, when `own` in it begins to do something else."""
    mock = QuickVehicle(autopilot)
    config = merged(QUICK_FLIGHT, OTHER_VEHICLES.get(autopilot, {}))

    async def main():
        async with connect(config, mock) as vehicle:
            await vehicle.take_off()
            flight = asyncio.ensure_future(vehicle.follow(made))
            await asyncio.sleep(0.5)
            own.does = does
            await flight

    with pytest.raises(companion.FlightEnded) as ended:
        run(mock, main())
    state = mock.state()
    assert state["mode"] in ("LOITER", "BRAKE")  # the autopilot holds it
    assert not state["crashed"]
    return str(ended.value)


ERRORS = {
    ZeroDivisionError("division by zero"): "ZeroDivisionError: division by zero",
    ValueError("of\ntwo lines"): "ValueError: of two lines",
    SystemExit(): "SystemExit",
    asyncio.CancelledError(): "CancelledError",
}
ONCE_SLOWED_AND_ONCE_NOT = [
    ("ardupilot", number % 2 == 0, *each) for number, each in enumerate(ERRORS.items())
]
"""Only the hand-back depends on the autopilot."""


@pytest.mark.parametrize(
    ("autopilot", "slowed", "error", "raised"),
    [
        *(("px4", slowed, *each) for slowed in (False, True) for each in ERRORS.items()),
        *ONCE_SLOWED_AND_ONCE_NOT,
    ],
    ids=lambda value: type(value).__name__ if isinstance(value, BaseException) else str(value),
)
def test_what_it_raises_is_its_own_error_and_the_vehicle_is_handed_back(
    autopilot, slowed, error, raised
):
    own = Ahead()
    result = result_of(autopilot, evenly_slowed(own, 1.5) if slowed else own, own, raising(error))
    lines = Path(__file__).read_text("utf-8").splitlines()
    assert result == (
        f"an error outside this program: the trajectory Ahead of the module {__name__} raised "
        f"{raised} ({__file__}:{lines.index('        raise error') + 1}); "
        "the vehicle is handed back"
    )


@pytest.mark.parametrize(
    ("does", "raised"),
    [
        (lambda _: None, "TypeError: .* must be an iterable, not NoneType"),
        (lambda sample: sample._replace(velocity=None), "TypeError: cannot unpack .* NoneType"),
        (lambda sample: sample._replace(heading=nan), "ValueError: at.* is not finite"),
    ],
)
def test_what_it_returns_is_checked_in_flight(does, raised):
    own = Ahead()
    result = result_of("px4", own, own, does)
    with pytest.raises(AssertionError, match=f"the trajectory Ahead of .* raised {raised}"):
        raise AssertionError(result)


def test_a_plain_tuple_serves_as_a_sample():
    own = Ahead()
    own.does = tuple
    sample = checked_trajectory(own).at(3.0)
    assert isinstance(sample, Sample)
    assert sample == own.path.at(3.0)


def test_an_error_of_a_trajectory_of_this_program_stays_what_it_is():
    with pytest.raises(TypeError, match="not supported between instances of 'str'"):
        UserTrajectory(line((4.0, 0.0, 0.0), 2.0, 2.0, 4.0)).at("now")
    with pytest.raises(TrajectoryError), naming_user_code("trajectory", Ahead(), TrajectoryError):
        raise TrajectoryError("too long")
    with pytest.raises(KeyboardInterrupt), naming_user_code("trajectory", Ahead()):
        raise KeyboardInterrupt


def test_the_message_of_an_error_has_its_beginning_and_its_end():
    with pytest.raises(UserCodeError) as raised, naming_user_code("trajectory", Ahead()):
        raise OSError("x" * 10_000)
    assert str(raised.value).startswith(MESSAGE_START)
    assert len(str(raised.value)) < 600
