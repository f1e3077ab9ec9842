"""The part of the live page that changes limits, gains and weights."""

import asyncio
from pathlib import Path
from typing import Any

from nicegui import ui

from companion.config.in_flight import value_text
from companion.files.write_whole import write_whole
from companion.files.yaml_file import ConfigError
from companion.flight.changes import ChangeRefusedError
from companion.live.channel import NoAnswerError
from companion.live.helper_process import FlightConnection
from companion.live.page.guard import Guard
from companion.live.page.page_data import PageData

_SOURCE = "the live page"
_DOWNLOAD_NAME = "changed.yaml"
_WRONG_TOKEN_DELAY = 1.0
"""Delay of the answer to a wrong token, s."""


class Panel:
    """Inputs and buttons of one browser tab; each tab must be unlocked separately.

    A tab that was opened with the token begins `unlocked`.
    """

    def __init__(
        self, connection: FlightConnection, page_data: PageData, guard: Guard, *, unlocked: bool
    ) -> None:
        self._connection, self._page_data, self._guard = connection, page_data, guard
        self._unlocked = unlocked
        self._inputs: dict[tuple[str, str], ui.input] = {}
        self._shown_texts: dict[tuple[str, str], str] = {}
        with ui.expansion("Change values in flight").classes("live-wide").props("id=live-panel"):
            self._add_unlock_row()
            with ui.element("div").classes("live-values"):
                for key in page_data.values():
                    name = key.section, key.name
                    self._shown_texts[name] = value_text(key.value)
                    self._inputs[name] = ui.input(
                        f"{key.section}.{key.name}", value=self._shown_texts[name]
                    ).props(f'dense suffix="{key.unit}" hint="{_range_text(key.allowed_values)}"')
            with ui.row():
                ui.button("Apply", on_click=self._apply).props("id=live-apply")
                self._undo = ui.button("Undo", on_click=self._undo_last).props("id=live-undo")
                ui.button("Save as YAML", on_click=self._save).props("id=live-save outline")
            self._message = ui.label().props("id=live-said role=status")
        ui.timer(0.5, self._refresh)

    def _add_unlock_row(self) -> None:
        with ui.row().bind_visibility_from(self, "_unlocked", value=False):
            token = ui.input("token, as shown at the start").props("dense")

            async def unlock() -> None:
                if self._guard.is_token(str(token.value or "").strip()):
                    self._unlocked = True
                    self._show_message("values can be changed in this tab now")
                else:
                    await asyncio.sleep(_WRONG_TOKEN_DELAY)
                    self._show_message(
                        "this is not the token; the program showed it when it started"
                    )

            ui.button("Unlock", on_click=unlock).props("id=live-unlock")

    async def _apply(self) -> None:
        values: dict[str, dict[str, Any]] = {}
        for (section, key), field in self._inputs.items():
            text = str(field.value or "").strip()
            if text != self._shown_texts[section, key]:
                values.setdefault(section, {})[key] = _parsed_value(text)
        if not values:
            self._show_message("nothing to apply: no value was changed")
            return
        await self._ask(self._connection.change(values, _SOURCE))

    async def _undo_last(self) -> None:
        await self._ask(self._connection.undo(_SOURCE))

    async def _ask(self, request: Any) -> None:
        if not self._unlocked:
            request.close()
            self._show_message("refused: give the token first")
            return
        try:
            self._show_message(await request)
            self._refresh()  # otherwise the next request would send these values again
        except (ConfigError, ChangeRefusedError) as error:
            self._show_message(f"refused: {error}")
        except NoAnswerError as error:
            self._show_message(str(error))

    async def _save(self) -> None:
        """Send the changed values to the browser; if unlocked, also write them to the folder."""
        text = self._page_data.changed_yaml()
        ui.download.content(text, _DOWNLOAD_NAME)
        folder = self._connection.first_message["folder"]
        if folder is None or not self._unlocked:
            self._show_message("saved where the browser saves files")
            return
        path = Path(folder, _DOWNLOAD_NAME)
        try:
            await asyncio.to_thread(write_whole, path, text)
        except OSError as error:
            self._show_message(f"{path} was not written: {error.strerror}")
        else:
            self._show_message(f"saved as {path}")

    def _refresh(self) -> None:
        """Show values changed elsewhere, except in edited fields; enable or disable Undo."""
        for key in self._page_data.values():
            name, value = (key.section, key.name), value_text(key.value)
            field = self._inputs[name]
            if value != self._shown_texts[name]:
                if str(field.value or "").strip() == self._shown_texts[name] or field.value is None:
                    field.value = value
                self._shown_texts[name] = value
        self._undo.set_enabled(self._page_data.can_undo and self._page_data.end_text is None)

    def _show_message(self, text: str) -> None:
        self._message.set_text(text)


def _range_text(allowed: str) -> str:
    """The allowed range of a key, for its input field.

    `allowed`: text of the reference; its words "changeable in flight" are left out, because every
    key of the panel can be changed in flight.
    """
    return (
        allowed.replace("changeable in flight within its range", "")
        .strip(", ")
        .replace("changeable in flight ", "")
    )


def _parsed_value(text: str) -> Any:
    """Convert the text of a field to a number, or to None if it is empty.

    Any other text is returned unchanged; the checks of the change refuse it.
    """
    if text in ("", "null"):
        return None
    try:
        return float(text)
    except ValueError:
        return text
