"""Access to the live page: other web sites are refused; other computers need token or cookie."""

import hmac
import socket
from collections.abc import Awaitable, Callable, MutableMapping
from http.cookies import CookieError, SimpleCookie
from ipaddress import ip_address
from typing import Any
from urllib.parse import parse_qs, urlsplit

Scope = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[MutableMapping[str, Any]]]
Send = Callable[[MutableMapping[str, Any]], Awaitable[None]]
App = Callable[[Scope, Receive, Send], Awaitable[None]]

_COOKIE = "companion_watch"


class Guard:
    """ASGI middleware around the page; it checks every request and every WebSocket."""

    def __init__(self, app: App, token: str) -> None:
        self._app, self._token = app, token
        # The cookie allows watching only; changing needs the token itself.
        self._cookie = hmac.digest(token.encode(), b"watch", "sha256").hex()

    def is_token(self, token: str) -> bool:
        """Whether `token` is the live page's token."""
        return hmac.compare_digest(token.encode(), self._token.encode())

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a connection on, or refuse it."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        headers = {
            key.decode("latin-1"): value.decode("latin-1") for key, value in scope["headers"]
        }
        query = parse_qs(scope.get("query_string", b"").decode("latin-1"))
        has_token = self.is_token(query.get("token", [""])[0])
        refusal = self._refusal(scope, headers, has_token=has_token)
        if refusal is not None:
            await _refuse(scope, send, refusal)
        elif has_token and scope["type"] == "http":
            await self._app(scope, receive, self._with_cookie(send))
        else:
            await self._app(scope, receive, send)

    def _refusal(self, scope: Scope, headers: dict[str, str], *, has_token: bool) -> str | None:
        host, origin = headers.get("host", ""), headers.get("origin")
        if not _is_address_or_own_name(host):
            return f"the live page does not accept the host {host!r}; open it by its IP address"
        if origin is not None and _host_in(origin) != host:
            return f"another site, {origin!r}, must not use the live page"
        client = scope.get("client")
        is_local = client is not None and ip_address(client[0]).is_loopback
        if is_local or has_token or self._has_cookie(headers):
            return None
        return (
            "to open the live page from another computer, add ?token= and the token shown at the "
            "start to its address"
        )

    def _has_cookie(self, headers: dict[str, str]) -> bool:
        try:
            cookie = SimpleCookie(headers.get("cookie", "")).get(_COOKIE)
        except CookieError:
            return False
        return cookie is not None and hmac.compare_digest(
            cookie.value.encode(), self._cookie.encode()
        )

    def _with_cookie(self, send: Send) -> Send:
        """Wrap `send`: the response gets a cookie that allows this browser to watch."""
        cookie = f"{_COOKIE}={self._cookie}; HttpOnly; SameSite=Strict; Path=/"

        async def send_with_cookie(message: MutableMapping[str, Any]) -> None:
            if message["type"] == "http.response.start":
                headers = [*message.get("headers", ()), (b"set-cookie", cookie.encode())]
                message = {**message, "headers": headers}
            await send(message)

        return send_with_cookie


def _host_in(origin: str) -> str:
    """The host and port in an Origin header; empty if the header is malformed."""
    try:
        return urlsplit(origin).netloc
    except ValueError:
        return ""


def _is_address_or_own_name(host: str) -> bool:
    """Whether a Host header names an IP address, localhost, or this computer.

    Other names are refused: a web site could let its own name point to this computer.
    """
    try:
        name = urlsplit(f"//{host}").hostname or ""
    except ValueError:  # such as an unclosed bracket
        return False
    try:
        ip_address(name)
    except ValueError:
        own_name = socket.gethostname().lower()
        return name in ("localhost", own_name, f"{own_name}.local")
    return True


async def _refuse(scope: Scope, send: Send, reason: str) -> None:
    if scope["type"] == "websocket":
        await send({"type": "websocket.close", "code": 1008, "reason": reason[:120]})
        return
    headers = [(b"content-type", b"text/plain; charset=utf-8")]
    await send({"type": "http.response.start", "status": 403, "headers": headers})
    await send({"type": "http.response.body", "body": reason.encode()})
