"""The flight's interface to the helper process: sends events, and makes requested changes."""

import asyncio
import json
import socket
import subprocess
import sys
from collections.abc import Callable, Coroutine
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

from companion.config import Config
from companion.config.known_drag import KnownDrag
from companion.flight.changes import ChangeRefusedError, Changes
from companion.flight.status import FlightStatus
from companion.live.addresses import PageSocket, StreamAddress
from companion.live.channel import Channel, Feed, Message
from companion.realtime import use_normal_scheduler

T = TypeVar("T")

_MOST_MESSAGES_PER_TURN = 10
"""Largest number of messages handled in one turn of the event loop; attitude samples are answered
between two turns."""


class HelperTasks(NamedTuple):
    """The tasks of the helper process."""

    watched_file: Path | None
    """Configuration file whose edits are applied in flight, or None."""
    config_as_read: Config
    """Configuration as read from its file, before options of the command line changed it."""
    page: PageSocket | None
    """Listening socket of the live page; None: no live page."""
    stream: StreamAddress | None
    """Address of the live stream; None: no live stream."""
    flies_maneuvers: bool
    """Whether the flight flies the maneuvers of its configuration."""
    folder: Path | None
    """Folder of the flight, for `live.log` and saved values; None: nothing is recorded."""


class Helper:
    """An observer that passes phases, events and states on to the helper process without waiting.

    Attributes:
        changes: makes the changes that the process requests; the caller sets it to the session's
            `changes` before the flight begins.
        note: called with each sentence for the user that the process sends.
        feed: sends the records for the live stream; None: no live stream.

    Raises:
        OSError: the process cannot be started.
    """

    def __init__(self, tasks: HelperTasks, config: Config) -> None:
        self.changes = Changes(config)
        self.note: Callable[[str], None] = lambda _: None
        self._name, self._has_ended = _helper_name(tasks), False
        self._channel, process_end = Channel.pair()
        self.feed: Feed | None = None
        feed_end: socket.socket | None = None
        if tasks.stream is not None:
            self.feed, feed_end = Feed.pair()
        page_socket = None if tasks.page is None else tasks.page.listening_socket
        self._process = _start_process((process_end, page_socket, feed_end), tasks.folder)
        process_end.close()
        if feed_end is not None:
            feed_end.close()
        self._send("start", **_first_message(tasks, config))

    @property
    def dropped(self) -> int:
        """Number of messages (not records for the stream) that could not be sent to the process."""
        return self._channel.dropped

    async def run_while_serving(self, work: Coroutine[Any, Any, T]) -> T:
        """Run `work`, and handle the requests of the process at the same time."""
        loop = asyncio.get_running_loop()
        self.changes.on_change, self.changes.on_known_drag = self._send_change, self._send_drag
        loop.add_reader(self._channel.fileno(), self._on_readable)
        try:
            return await work
        finally:
            loop.remove_reader(self._channel.fileno())

    def close(self, reason: str) -> None:
        """Tell the process why the flight has ended. The process goes on while it has users."""
        self._send("end", text=reason)
        self._has_ended = True
        self._channel.close()
        if self.feed is not None:
            self.feed.close()

    def phase(self, name: str, waits_for: str) -> None:
        """Send a phase to the process."""
        self._send("phase", name=name, waits_for=waits_for)

    def waiting(self, name: str, waiting_for: str, elapsed: float, timeout: float) -> None:
        """Do nothing: `status` sends the same text."""

    def status(self, status: FlightStatus) -> None:
        """Send the state of the flight to the process."""
        battery = status.battery
        self._send(
            "status",
            time_s=round(status.time, 3),
            phase=status.phase,
            detail=status.waiting_for,
            maneuver=status.maneuver,
            maneuver_elapsed_s=round(status.maneuver_elapsed, 1),
            maneuver_duration_s=status.maneuver_duration,
            airborne_s=status.airborne_time,
            speed_m_s=status.speed,
            tilt_rad=status.tilt,
            error_m=status.tracking_error,
            rate_hz=status.setpoint_rate,
            latency_us=None if status.latency is None else 1e6 * status.latency,
            missed_deadlines=status.missed_deadlines,
            battery_remaining=None if battery is None else battery.remaining,
            battery_v=None if battery is None else battery.voltage_v,
            alarms=list(status.alarms),
            monitored=status.monitored,
            dropped=self._channel.dropped,
            stream_dropped=0 if self.feed is None else self.feed.dropped,
            **status.view,
        )

    def event(self, time: float, text: str) -> None:
        """Send an event to the process."""
        self._send("event", time_s=round(time, 3), text=text)

    def _send(self, kind: str, **content: Any) -> None:
        self._channel.send({"kind": kind, **content})
        if not self._channel.is_open and kind != "end":
            self._note_ended()

    def _note_ended(self) -> None:
        """Tell the user, once, that the process has ended."""
        if not self._has_ended:
            self._has_ended = True
            self.note(f"{self._name} has ended by itself; the flight goes on without it")

    def _send_change(self, config: Config) -> None:
        change = str(self.changes.all_changes[-1])
        self._send("config", config=_as_json(config), can_undo=self.changes.can_undo, text=change)

    def _send_drag(self, known_drag: KnownDrag) -> None:
        drag, source = known_drag.drag, known_drag.source
        self._send(
            "drag",
            drag=None if drag is None else [drag.linear, drag.quadratic],
            source=None if source is None else str(source),
        )

    def _on_readable(self) -> None:
        """Handle the requests of the process."""
        for message in self._channel.received_messages(_MOST_MESSAGES_PER_TURN):
            if message is None:
                asyncio.get_running_loop().remove_reader(self._channel.fileno())
                self._note_ended()
            else:
                self._handle(message)

    def _handle(self, message: Message) -> None:
        kind, by = message.get("kind"), str(message.get("by", self._name))
        if kind == "note":
            self.note(str(message.get("text")))
            return
        try:
            if kind == "undo":
                text = self.changes.undo(by)
            else:
                text = self.changes.change(message.get("values") or {}, by)
        except (ChangeRefusedError, ValueError, ArithmeticError) as error:
            self._send("answer", id=message.get("id"), refusal=str(error))
        else:
            self._send("answer", id=message.get("id"), refusal=None, text=text)


def _helper_name(tasks: HelperTasks) -> str:
    """Name of the helper process for the user, such as "the live page" or "the file watcher"."""
    if tasks.page is not None:
        return "the live page"
    return "the file watcher" if tasks.stream is None else "the live stream"


def _start_process(
    sockets: tuple[socket.socket | None, ...], folder: Path | None
) -> "subprocess.Popen[bytes]":
    """Start the helper process, which survives Ctrl-C and outlives the flight."""
    descriptors = [-1 if each is None else each.fileno() for each in sockets]
    command = [sys.executable, "-m", "companion.live.helper_process", *map(str, descriptors)]
    log = Path("/dev/null") if folder is None else folder / "live.log"
    with log.open("ab") as output:
        process = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=output,
            pass_fds=[each for each in descriptors if each >= 0],
            start_new_session=True,
        )
    use_normal_scheduler(process.pid)  # it must not compute with the flight's real-time priority
    return process


def _first_message(tasks: HelperTasks, config: Config) -> Message:
    page, stream = tasks.page, tasks.stream
    return {
        "config": _as_json(config),
        "config_as_read": _as_json(tasks.config_as_read),
        "flies_maneuvers": tasks.flies_maneuvers,
        "watched_file": None if tasks.watched_file is None else str(tasks.watched_file.absolute()),
        "folder": None if tasks.folder is None else str(tasks.folder.absolute()),
        "token": None if page is None else page.token,
        "port": None if page is None else page.port,
        "stream_host": None if stream is None else stream.host,
        "stream_port": None if stream is None else stream.port,
    }


def _as_json(config: Config) -> Message:
    json_config: Message = json.loads(config.model_dump_json())
    return json_config
