"""The helper process: watches the edited file, serves the live page and the live stream."""

import asyncio
import os
import socket
import sys
from collections.abc import Awaitable, Callable
from itertools import count
from pathlib import Path

from companion.config import Config
from companion.config.in_flight import Values
from companion.files.yaml_file import ConfigError
from companion.flight.changes import ChangeRefusedError
from companion.live.channel import Channel, Message, NoAnswerError
from companion.live.checks import ChangeChecks
from companion.live.watched_file import WatchedFile

_CHECK_PERIOD_S = 0.06
"""Period of checks of the watched file, s; an edit is found by the third check after it."""
_ANSWER_TIMEOUT = 3.0
"""Time allowed for the flight to answer, s."""
_NICENESS = 5
"""Niceness of the process, so that it yields to the flight."""


class FlightConnection:
    """The helper process's end of the channel to the flight: requests changes, takes messages.

    Attributes:
        first_message: the first message of the flight: configuration and tasks (`HelperTasks`).
        checks: checks requested changes.
        flight_ended: set when the flight has ended.
    """

    def __init__(self, channel: Channel, first_message: Message) -> None:
        self.first_message = first_message
        config = Config.model_validate(first_message["config"])
        self.checks = ChangeChecks(config, flies_maneuvers=first_message["flies_maneuvers"])
        self.flight_ended = asyncio.Event()
        self._channel = channel
        self._ids = count()
        self._pending_answers: dict[int, asyncio.Future[Message]] = {}
        self._listeners: list[Callable[[Message], None]] = []
        self._request_lock = asyncio.Lock()
        asyncio.get_running_loop().add_reader(channel.fileno(), self._on_readable)

    def listen(self, listener: Callable[[Message], None]) -> None:
        """Call `listener` with each further message of the flight."""
        self._listeners.append(listener)

    async def change(self, values: Values, by: str) -> str:
        """Check new values and request them from the flight; return the change in words.

        Changes are made one after the other, each checked together with the earlier ones.

        Args:
            values: the new values, by section and key.
            by: who or what requests the change, such as the edited file.

        Raises:
            ConfigError: the values cannot be used.
            ChangeRefusedError: the flight refuses them, cannot take them, or has ended.
            NoAnswerError: the flight did not answer in time; the change may be in force.
        """
        async with self._request_lock:
            await asyncio.to_thread(self.checks.check, values, by)
            return await self._ask({"kind": "change", "values": values, "by": by})

    async def undo(self, by: str) -> str:
        """Ask the flight to undo the newest change; return the new change in words.

        The stability margins are not checked again.

        Raises:
            ChangeRefusedError, NoAnswerError: see `change`.
        """
        async with self._request_lock:
            return await self._ask({"kind": "undo", "by": by})

    async def _ask(self, message: Message) -> str:
        """Send a request and wait for the answer in words.

        Raises:
            ChangeRefusedError: the flight refuses the request, cannot take it, or has ended.
            NoAnswerError: the flight did not answer in time; the request may be in force.
        """
        number = next(self._ids)
        answer = self._pending_answers[number] = asyncio.get_running_loop().create_future()
        try:
            if self.flight_ended.is_set() or not self._channel.send({**message, "id": number}):
                has_ended = self.flight_ended.is_set() or not self._channel.is_open
                reason = (
                    "the flight has ended"
                    if has_ended
                    else "the flight is too busy to take the change"
                )
                raise ChangeRefusedError(f"{reason}; nothing has changed")
            async with asyncio.timeout(_ANSWER_TIMEOUT):
                reply = await answer
        except TimeoutError as error:
            raise NoAnswerError(
                f"no answer from the flight within {_ANSWER_TIMEOUT:g} s; the change may have been "
                "applied, so look at the values of the flight"
            ) from error
        finally:
            del self._pending_answers[number]
        if reply.get("refusal") is not None:
            raise ChangeRefusedError(str(reply["refusal"]))
        return str(reply.get("text"))

    def note(self, text: str) -> None:
        """Send a sentence to the flight, which records it and shows it to the user."""
        self._channel.send({"kind": "note", "text": text})

    def _on_readable(self) -> None:
        for message in self._channel.received_messages():
            if message is None:
                asyncio.get_running_loop().remove_reader(self._channel.fileno())
                self.flight_ended.set()
            else:
                self._take_message(message)

    def _take_message(self, message: Message) -> None:
        if message["kind"] == "config":
            self.checks.current_config = Config.model_validate(message["config"])
        elif message["kind"] == "drag":
            self.checks.note_drag(message)
        answer = self._pending_answers.get(message.get("id", -1))
        if answer is not None and not answer.done():
            answer.set_result(message)
        for take in self._listeners:
            take(message)


async def watch(connection: FlightConnection, path: Path) -> None:
    """Apply the edits of a file until the flight ends."""
    config_as_read = Config.model_validate(connection.first_message["config_as_read"])
    watched_file = WatchedFile(path, config_as_read, connection.checks.check)
    connection.note(f"edits of {path.name} are applied from now on")
    while not connection.flight_ended.is_set():
        edit = await asyncio.to_thread(watched_file.newest_edit)
        if edit is not None and edit.refusal is not None:
            connection.note(edit.refusal)
        elif edit is not None:
            try:
                await connection.change(edit.values, path.name)
                watched_file.accept()
            except (ConfigError, ChangeRefusedError) as refused:
                connection.note(f"{path.name} is not applied: {refused}")
            except NoAnswerError as error:
                connection.note(f"{path.name}: {error}")
                watched_file.accept()  # so that an edit back to the old values is sent
        await asyncio.sleep(_CHECK_PERIOD_S)


async def _serve(channel_fd: int, page_fd: int, feed_fd: int) -> None:
    """Do the tasks that the flight's first message names.

    Args:
        channel_fd: file descriptor of the channel to the flight.
        page_fd: file descriptor of the live page's listening socket; −1: no live page.
        feed_fd: file descriptor of the socket on which the flight sends its records for the live
            stream; −1: no live stream.
    """
    channel = Channel(socket.socket(fileno=channel_fd))
    first_message = next(channel.received_messages(1))
    if first_message is None:
        return
    os.set_blocking(channel_fd, False)
    connection = FlightConnection(channel, first_message)
    serving: list[Awaitable[None]] = [_watch_until_ended(connection)]
    if feed_fd >= 0:
        from companion.live.foxglove_stream import serve_stream  # noqa: PLC0415  needs the extra

        serving.append(serve_stream(connection, socket.socket(fileno=feed_fd)))
    if page_fd >= 0:
        from companion.live.page.server import serve_page  # noqa: PLC0415  needs the extra

        serving.append(serve_page(connection, socket.socket(fileno=page_fd)))
    await asyncio.gather(*serving)


async def _watch_until_ended(connection: FlightConnection) -> None:
    """Wait for the end of the flight; until then watch the file, if a file is to be watched."""
    path = connection.first_message["watched_file"]
    watch_task = None if path is None else asyncio.create_task(watch(connection, Path(path)))
    await connection.flight_ended.wait()
    if watch_task is not None:
        watch_task.cancel()


if __name__ == "__main__":
    os.nice(_NICENESS)
    asyncio.run(_serve(*map(int, sys.argv[1:])))
