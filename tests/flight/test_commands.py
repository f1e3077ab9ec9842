"""Orders: repeated only after asking whose the vehicle is, and never without need."""

import ast
import asyncio
from pathlib import Path
from types import SimpleNamespace

import pytest

from companion.flight.commands import change_mode, command_if_ours, require_role
from companion.mavlink.commands import Command
from companion.mavlink.errors import CommandRefused, CommandTimeout, CommandUnfinished
from companion.safety.actions import Exit, FlightEnded
from companion.vehicle.autopilot import Role

LAND = Command(21)
LOST, REFUSED = CommandTimeout("lost"), CommandRefused("LAND", 4, "FAILED", ())


COMPANION = Path(__file__).parents[2] / "companion"


def test_every_command_of_a_flight_goes_through_one_function():
    """`context.py` asks for a heartbeat by REQUEST_MESSAGE, which changes nothing."""
    senders = {
        path.name
        for room in ("control", "safety", "flight")
        for path in (COMPANION / room).rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.Call)
        and isinstance(node.func, ast.Attribute)
        and ast.unparse(node.func).endswith("link.command")
    }
    assert senders == {"commands.py", "context.py"}


class Vehicle:
    """Answers as it is told to, one answer a command, and reports its modes after each of them."""

    def __init__(self, *answers):
        self.answers = list(answers)
        self.mode, self.sent = Role.OFFBOARD, 0
        self.mode_by_failsafe = self.mode_not_intended = False
        self.link = self.autopilot = self.state = self
        self.now, self.subscribers = 0.0, []
        self.replacement_detector = SimpleNamespace(require=lambda: None)

    @property
    def mode_received_at(self):
        return asyncio.get_running_loop().time()

    def roles(self, mode):
        return frozenset({mode})

    def subscribe(self, _, callback):
        self.subscribers.append(callback)
        return lambda: self.subscribers.remove(callback)

    def report(self, mode):
        self.mode = mode
        for each in self.subscribers:
            each(None)

    async def fresh_heartbeat(self):
        await asyncio.sleep(0)
        self.report(self.mode)

    async def until(self, condition):
        while not condition():  # noqa: ASYNC110
            await asyncio.sleep(0.001)

    async def command(self, number, *_, retries):
        assert retries == 0
        self.sent += 1
        answer, *modes = self.answers.pop(0)
        for mode in modes:
            self.report(mode)
        if answer is not None:
            raise answer


def run(vehicle, work=command_if_ours):
    landing = asyncio.run(
        work(
            vehicle,
            LAND,
            lambda: require_role(vehicle, {Role.OFFBOARD, Role.LAND}),
            lambda: vehicle.mode is Role.LAND,
        )
    )
    return landing, vehicle.sent


@pytest.mark.parametrize(
    ("answers", "sent"),
    [
        ([(None, Role.LAND)], 1),
        ([(LOST, Role.OFFBOARD), (None, Role.LAND)], 2),
        ([(LOST, Role.LAND)], 1),  # only the answer was lost
        ([(LOST, Role.OFFBOARD), (REFUSED, Role.LAND)], 2),  # it does so already
    ],
)
def test_it_is_given_until_it_is_answered_or_shows(answers, sent):
    assert run(Vehicle(*answers)) == (None, sent)


def test_it_is_not_repeated_over_a_mode_that_is_not_ours():
    vehicle = Vehicle((LOST, Role.HOLD))
    with pytest.raises(FlightEnded, match="took over") as ended:
        run(vehicle)
    assert (ended.value.exit, vehicle.sent) == (Exit.RELEASE, 1)


@pytest.mark.parametrize("tries", [1, 4])
def test_a_command_that_was_obeyed_and_undone_by_others_is_not_repeated(tries):
    """Its answer was lost, and the pilot chose a mode in which we might command."""
    lost = [(LOST, Role.OFFBOARD)] * (tries - 1)
    vehicle = Vehicle(*lost, (LOST, Role.LAND, Role.OFFBOARD), (None, Role.LAND))
    with pytest.raises(FlightEnded, match="took over") as ended:
        run(vehicle)
    assert (ended.value.exit, vehicle.sent) == (Exit.RELEASE, tries)
    assert not vehicle.subscribers


def test_an_effect_from_before_the_first_try_is_not_the_command_s():
    vehicle = Vehicle((LOST, Role.OFFBOARD), (None, Role.LAND))
    vehicle.mode = Role.LAND

    async def scene():
        def require_control():
            require_role(vehicle, {Role.OFFBOARD, Role.LAND})
            vehicle.mode = Role.OFFBOARD  # as a heartbeat from before our arming shows disarmed

        await command_if_ours(vehicle, LAND, require_control, lambda: vehicle.mode is Role.LAND)

    asyncio.run(scene())
    assert vehicle.sent == 2


def test_a_refusal_is_one():
    with pytest.raises(CommandRefused):
        run(Vehicle((REFUSED, Role.OFFBOARD)))


def test_it_is_given_four_times_at_most():
    vehicle = Vehicle(*[(LOST, Role.OFFBOARD)] * 9)
    with pytest.raises(CommandTimeout, match="no answer to 4 tries"):
        run(vehicle)
    assert vehicle.sent == 4


def test_a_command_that_stays_in_progress_is_told_so():
    vehicle = Vehicle(*[(CommandUnfinished("in progress"), Role.OFFBOARD)] * 9)
    with pytest.raises(CommandUnfinished, match="in progress"):
        run(vehicle)
    assert vehicle.sent == 1, "four tries would take 30 s each"
    assert run(Vehicle((CommandUnfinished("in progress"), Role.LAND))) == (None, 1)


def test_a_mode_that_was_entered_and_left_again_is_somebodys(monkeypatch):
    monkeypatch.setattr("companion.flight.commands._MODE_REPORT_TIMEOUT", 0.01)
    with pytest.raises(FlightEnded, match=r"reports a mode that we did not command: Role\.HOLD"):
        run(Vehicle((None, Role.HOLD)), change_mode)
