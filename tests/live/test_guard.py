"""Who may speak to the live page, without a browser; and its address."""

import asyncio
import socket

import pytest

from companion.files.yaml_file import ConfigError
from companion.live.addresses import PageSocket, open_page_socket
from companion.live.page.guard import Guard

TOKEN = "secret"


def _asked(headers, client="127.0.0.1", query="", kind="http"):
    """(status or "passed", headers of the answer)."""
    sent, passed = [], []

    async def app(scope, receive, send):
        passed.append(scope)
        await send({"type": "http.response.start", "status": 200, "headers": []})

    async def send(message):
        sent.append(message)

    scope = {
        "type": kind,
        "headers": [(key.encode(), value.encode()) for key, value in headers.items()],
        "client": (client, 5000),
        "query_string": query.encode(),
    }
    asyncio.run(Guard(app, TOKEN)(scope, None, send))
    answer = dict(sent[0].get("headers", ())) if sent else {}
    return ("passed" if passed else sent[0].get("status", sent[0]["type"])), answer


@pytest.mark.parametrize(
    ("headers", "told"),
    [
        ({"host": "127.0.0.1:8090"}, "passed"),
        ({"host": "localhost:8090", "origin": "http://localhost:8090"}, "passed"),
        ({"host": "[::1]:8090"}, "passed"),
        ({"host": "127.0.0.1:8090", "origin": "http://127.0.0.1:8091"}, 403),
        ({"host": "127.0.0.1:8090", "origin": "null"}, 403),
        ({"host": "evil.example:8090", "origin": "http://evil.example:8090"}, 403),
        ({"host": "[::1"}, 403),
        ({"host": "127.0.0.1:8090", "origin": "http://[::1"}, 403),
        ({}, 403),
    ],
)
def test_other_sites_and_names_are_refused(headers, told):
    assert _asked(headers)[0] == told


def test_a_websocket_of_another_site_is_refused():
    headers = {"host": "127.0.0.1:8090", "origin": "http://example.com"}
    assert _asked(headers, kind="websocket")[0] == "websocket.close"


def test_another_computer_needs_the_token_and_keeps_a_cookie_that_only_watches():
    host = {"host": "192.168.1.5:8090"}
    assert _asked(host, client="192.168.1.9")[0] == 403
    assert _asked(host, client="192.168.1.9", query="token=wrong")[0] == 403
    told, answer = _asked(host, client="192.168.1.9", query=f"token={TOKEN}")
    assert told == "passed"
    cookie = answer[b"set-cookie"].decode()
    assert TOKEN not in cookie
    assert "HttpOnly" in cookie
    assert "SameSite=Strict" in cookie
    again = {**host, "cookie": cookie.split(";")[0]}
    assert _asked(again, client="192.168.1.9")[0] == "passed"
    assert _asked({**host, "cookie": "companion_watch=0"}, client="192.168.1.9")[0] == 403


@pytest.mark.parametrize("address", ["nowhere", "127.0.0.1:x", ":99999", "1.2.3", "host:80"])
def test_a_wrong_address_is_one_sentence(address):
    with pytest.raises(ConfigError, match="--live"):
        open_page_socket(address)


def test_a_port_in_use_is_named():
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        with pytest.raises(ConfigError, match=f"port {port} of 127.0.0.1"):
            open_page_socket(str(port))


def test_an_address_of_another_computer_is_not_a_matter_of_the_port():
    with pytest.raises(ConfigError, match=r"has that address; use --live 0\.0\.0\.0:8090"):
        open_page_socket("192.0.2.1")


def test_the_door_is_of_this_computer_and_has_a_new_token_each_time():
    first, second = open_page_socket(":0"), open_page_socket("0")
    assert first.host == second.host == "127.0.0.1"
    assert first.token != second.token
    assert len(first.token) >= 12
    assert f"127.0.0.1:{first.port}" in first.address_text()
    for page_socket in (first, second):
        page_socket.listening_socket.close()


def test_a_door_for_other_computers_is_told_with_its_name_and_token():
    told = PageSocket("0.0.0.0", 8090, "secret", None).address_text()
    assert told == f"Live page: http://{socket.gethostname()}:8090/?token=secret"
    assert (
        "http://[2001:db8::1]:8090/?token="
        in PageSocket("2001:db8::1", 8090, "s", None).address_text()
    )


def test_a_cookie_that_cannot_be_read_admits_nobody():
    headers = {"host": "192.168.1.5:8090", "cookie": "companion_watch=1; a\x01b=;=\x00"}
    assert _asked(headers, client="192.168.1.9")[0] == 403
    assert _asked({**headers, "cookie": "a(b=1"}, client="192.168.1.9")[0] == 403


def test_the_start_of_the_server_is_not_a_request():
    passed = []

    async def app(scope, _receive, _send):
        passed.append(scope["type"])

    asyncio.run(Guard(app, TOKEN)({"type": "lifespan"}, None, None))
    assert passed == ["lifespan"]
