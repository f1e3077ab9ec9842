"""The page of a flight, drawn and used in this process by NiceGUI's own simulated user."""

import asyncio
import sys
from contextlib import asynccontextmanager
from importlib.util import find_spec

import pytest

from companion.config import Config
from companion.config.files import changed
from companion.files.yaml_file import ConfigError
from companion.flight.changes import ChangeRefusedError
from companion.live.channel import NoAnswerError
from companion.live.page.guard import Guard
from companion.live.page.page_data import PageData

pytestmark = pytest.mark.skipif(
    find_spec("nicegui") is None, reason="the extra `live` is not installed"
)

TOKEN, CLIMB = "secret", "limits.max_climb_m_s"


class FlightConnection:
    """Answers requests as a flight does, or with `refusal`.

    Attributes:
        first_message: the first message of the flight.
        asked: values of each change, and "undo".
        refusal: error that answers the next requests, or None.
    """

    def __init__(self, page_data, folder):
        self.first_message = {"folder": None if folder is None else str(folder)}
        self.asked, self.refusal = [], None
        self._page_data, self._start = page_data, page_data.config

    async def change(self, values, by):
        self._ask(values, by)
        return self._answer(changed(self._page_data.config, values, by), can_undo=True)

    async def undo(self, by):
        self._ask("undo", by)
        return self._answer(self._start, can_undo=False)

    def _ask(self, asked, by):
        assert by == "the live page"
        self.asked.append(asked)
        if self.refusal is not None:
            raise self.refusal

    def _answer(self, config, *, can_undo):
        told = config.model_dump(mode="json")
        self._page_data.take({"kind": "config", "config": told, "can_undo": can_undo})
        return f"done {len(self.asked)}"


class Page:
    """The page as the simulated user sees it."""

    def __init__(self, user, connection, page_data):
        self.user, self.connection, self.page_data = user, connection, page_data

    def element(self, kind, name):
        (found,) = (
            each
            for each in self.user.find(kind).elements
            if name in (each.props.get("label"), each.props.get("id"))
        )
        return found

    def value(self, key):
        from nicegui import ui  # noqa: PLC0415  an extra

        return self.element(ui.input, key).value

    def type(self, key, text):
        from nicegui import ui  # noqa: PLC0415  an extra

        with self.user:
            self.element(ui.input, key).value = text

    async def click(self, name, said):
        from nicegui import ui  # noqa: PLC0415  an extra
        from nicegui.testing.user_interaction import UserInteraction  # noqa: PLC0415

        UserInteraction(self.user, {self.element(ui.button, f"live-{name}")}, None).click()
        for _ in range(60):
            if said in self.element(ui.label, "live-said").text:
                return
            await asyncio.sleep(0.05)
        raise AssertionError(self.element(ui.label, "live-said").text)

    def can_undo(self):
        from nicegui import ui  # noqa: PLC0415  an extra

        return self.element(ui.button, "live-undo").enabled

    async def until(self, true):
        for _ in range(60):
            if true():
                return
            await asyncio.sleep(0.05)
        raise AssertionError("not within 3 s")


@asynccontextmanager
async def used(folder=None, path="/"):
    """The page, opened in this process."""
    from nicegui.testing import user_simulation  # noqa: PLC0415  an extra

    from companion.live.page.layout import add_page  # noqa: PLC0415  needs it

    ours = {name: each for name, each in sys.modules.items() if name.split(".")[0] == "companion"}
    try:
        async with user_simulation() as user:
            page_data = PageData(Config())
            connection = FlightConnection(page_data, folder)
            add_page(connection, page_data, Guard(None, TOKEN))
            await user.open(path)
            yield Page(user, connection, page_data)
    finally:
        sys.modules.update(ours)  # the simulation takes out the module of the page and its parents


async def test_without_the_token_nothing_changes_and_nothing_is_saved_on_this_computer(tmp_path):
    async with used(tmp_path) as page:
        page.type(CLIMB, "1.5")
        await page.click("apply", "refused: give the token first")
        await page.click("undo", "refused: give the token first")
        page.type("token, as shown at the start", "secre")
        await page.click("unlock", "this is not the token")
        await page.click("apply", "refused: give the token first")
        await page.click("save", "saved where the browser saves files")
        assert page.connection.asked == []
        page.type("token, as shown at the start", f" {TOKEN} ")
        await page.click("unlock", "values can be changed in this tab now")
        await page.click("apply", "done 1")
        assert page.connection.asked == [{"limits": {"max_climb_m_s": 1.5}}]
    assert not list(tmp_path.iterdir())


async def test_only_the_edited_values_are_sent_and_never_twice():
    async with used(path=f"/?token={TOKEN}") as page:
        before = page.value(CLIMB)
        await page.click("apply", "nothing to apply: no value was changed")
        page.type(CLIMB, "1.5")
        await page.click("apply", "done 1")
        # At once: the value in force is known as soon as the flight has answered.
        page.type("limits.max_tilt_deg", "30")
        await page.click("apply", "done 2")
        page.type("limits.max_tilt_deg", "")
        await page.click("apply", "`limits.max_tilt_deg` has no value")
        page.type("limits.max_tilt_deg", "steep")
        await page.click("apply", "must be a number")
        assert page.connection.asked == [
            {"limits": {"max_climb_m_s": 1.5}},
            {"limits": {"max_tilt_deg": 30.0}},
            {"limits": {"max_tilt_deg": None}},
            {"limits": {"max_tilt_deg": "steep"}},
        ]
        await page.until(page.can_undo)
        await page.click("undo", "done 5")
        await page.until(lambda: page.value(CLIMB) == before)
        assert not page.can_undo()


async def test_each_refusal_is_told():
    async with used(path=f"/?token={TOKEN}") as page:
        for refusal, said in (
            (ConfigError("the page: too steep"), "refused: the page: too steep"),
            (ChangeRefusedError("the flight has ended"), "refused: the flight has ended"),
            (NoAnswerError("no answer"), "no answer"),
        ):
            page.connection.refusal = refusal
            page.type(CLIMB, "1.5")
            await page.click("apply", said)
        assert page.value(CLIMB) == "1.5"


async def test_another_tabs_change_is_shown_but_not_over_an_edited_field():
    async with used(path=f"/?token={TOKEN}") as page:
        page.type("limits.max_tilt_deg", "31")
        await page.connection.change(
            {"limits": {"max_climb_m_s": 1.5, "max_tilt_deg": 30.0}}, "the live page"
        )
        await page.until(lambda: page.value(CLIMB) == "1.5")
        assert page.value("limits.max_tilt_deg") == "31"
        page.page_data.take({"kind": "end", "text": "the flight is over"})
        await page.until(lambda: not page.can_undo())


async def test_changed_values_are_saved_in_the_folder_or_the_reason_is_told(tmp_path):
    async with used(tmp_path, path=f"/?token={TOKEN}") as page:
        page.type(CLIMB, "1.5")
        await page.click("apply", "done 1")
        await page.click("save", f"saved as {tmp_path / 'changed.yaml'}")
        page.connection.first_message["folder"] = str(tmp_path / "gone")
        await page.click("save", "changed.yaml was not written: No such file or directory")
    assert "  max_climb_m_s: 1.5  # was 2.0\n" in (tmp_path / "changed.yaml").read_text()


async def test_new_states_and_events_are_pushed_once(monkeypatch):
    pushed = []

    async with used() as page:
        client = page.user.client
        client.run_javascript = pushed.append
        monkeypatch.setattr(type(client), "has_socket_connection", property(lambda _: True))
        page.page_data.take({"kind": "status", "time_s": 1.0, "phase": "hover"})
        page.page_data.take({"kind": "event", "time_s": 1.0, "text": "maneuver: hover"})
        await page.until(lambda: len(pushed) > 2)
        page.page_data.take({"kind": "end", "text": "the flight is over"})
        await page.until(lambda: '"over": "the flight is over"' in pushed[-1])
        monkeypatch.undo()
    assert sum('"phase": "hover"' in each for each in pushed) == 1
    assert sum("maneuver: hover" in each for each in pushed) == 1
