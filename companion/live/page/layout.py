"""The layout of the live page; `live.js` draws into it."""

import json
from pathlib import Path

from nicegui import Client, app, ui

from companion.live.helper_process import FlightConnection
from companion.live.page.guard import Guard
from companion.live.page.page_data import PageData
from companion.live.page.panel import Panel

_PAGE_FOLDER = Path(__file__).parent
_PUSH_PERIOD = 0.2
"""Period with which new states are sent to the browsers, s."""

_CELLS = (
    ("phase", "phase"),
    ("maneuver", "maneuver"),
    ("height_m", "height"),
    ("speed_m_s", "speed"),
    ("tilt_rad", "tilt"),
    ("error_m", "error"),
    ("rate_hz", "setpoints"),
    ("latency_us", "latency"),
    ("frames_lost", "link"),
    ("battery_remaining", "battery"),
    ("alarms", "safety"),
)
_PLOTS = (
    ("height", "height and reference, m"),
    ("error", "distance from the reference, m"),
    ("north", "coefficient north: target, measured"),
    ("east", "coefficient east: target, measured"),
    ("speed", "speed, m/s"),
    ("latency", "latency, ms"),
)


def add_page(connection: FlightConnection, page_data: PageData, guard: Guard) -> None:
    """Add the page, and send new states to all browsers that show it."""
    shared = f"<style>{_file_text('live.css')}</style><script>{_file_text('live.js')}</script>"
    ui.add_head_html(shared, shared=True)
    sent_counts: dict[str, tuple[int, int]] = {}

    @ui.page("/")
    def page(client: Client, token: str = "") -> None:
        _add_drawings()
        Panel(connection, page_data, guard, unlocked=guard.is_token(token))
        page_state = {
            "fence": page_data.fence(),
            "frames": page_data.states_since(0),
            "events": page_data.events_since(0),
        }
        sent_counts[client.id] = page_data.state_count, page_data.event_count
        client.run_javascript(f"live.begin({json.dumps(page_state)})")

    async def push() -> None:
        for client in list(Client.instances.values()):
            counts = sent_counts.get(client.id)
            if counts is None or not client.has_socket_connection:
                continue
            new_data = {
                "frames": page_data.states_since(counts[0]),
                "events": page_data.events_since(counts[1]),
                "fence": page_data.fence(),
                "over": page_data.end_text,
            }
            sent_counts[client.id] = page_data.state_count, page_data.event_count
            client.run_javascript(f"live.push({json.dumps(new_data)})")
        for closed_client_id in sent_counts.keys() - Client.instances.keys():
            del sent_counts[closed_client_id]

    app.timer(_PUSH_PERIOD, push)


def _add_drawings() -> None:
    with ui.element("header").classes("live-cells"):
        for name, label in _CELLS:
            with ui.element("div").classes("live-cell"):
                ui.html(label, sanitize=False).classes("live-label")
                ui.html(f'<span data-live="{name}">–</span>', sanitize=False).classes("live-value")
    ui.html('<div id="live-over" hidden></div>', sanitize=False).classes("live-wide")
    with ui.element("div").classes("live-grid"):
        for name, label in (
            ("horizon", "attitude"),
            ("disc", "tilt: ● measured, ○ target, + reference"),
            ("map", "plan: ● vehicle, + reference, dashed: fence"),
        ):
            _add_canvas(name, label, "live-square")
    with ui.element("div").classes("live-grid"):
        for name, label in _PLOTS:
            _add_canvas(name, label, "live-plot")
    ui.html('<ol id="live-events"></ol>', sanitize=False).classes("live-wide")


def _add_canvas(name: str, label: str, shape: str) -> None:
    ui.html(
        f'<figure class="{shape}"><figcaption>{label}</figcaption>'
        f'<canvas id="live-{name}"></canvas></figure>',
        sanitize=False,
    )


def _file_text(name: str) -> str:
    return (_PAGE_FOLDER / name).read_text(encoding="utf-8")
