"""The live page in headless Chromium: it shows, changes, refuses, and outlives its flight."""

from contextlib import suppress
from importlib.util import find_spec
from urllib.error import HTTPError
from urllib.request import Request, urlopen

import pytest

from tests.live.browser import CHROMIUM, chromium
from tests.live.pages import Page

pytestmark = [
    pytest.mark.skipif(
        CHROMIUM is None, reason="Chromium is not installed (Debian's package `chromium`)"
    ),
    # Not imported here: only the page's own process needs it.
    pytest.mark.skipif(find_spec("nicegui") is None, reason="the extra `live` is not installed"),
]

_SHOWN = "window.live && live.frames().length > 3"
_OPEN_PANEL = "document.querySelector('#live-panel .q-item').click()"
_SAID = "document.getElementById('live-said').innerText"


def _refusal(url, **headers):
    with pytest.raises(HTTPError) as refused:
        urlopen(Request(url, headers=headers), timeout=60)
    return refused.value.code, refused.value.read().decode()


def _moves(tab):
    here = "JSON.stringify(live.frames().slice(-1)[0])"
    before = tab.run(here)
    tab.wait(f"{here} !== {before!r}")
    drawn = "document.getElementById('live-disc').toDataURL()"
    picture = tab.run(drawn)
    tab.wait(f"{drawn} !== {picture!r}")


def _change(tab, label, value, said):
    tab.type(label, value)
    tab.click("apply")
    tab.wait(f"{_SAID}.includes({said!r})")


def _watch_and_change(new_tab, page, folder):
    """One tab: it shows the vehicle, is refused without token and beyond bounds, and changes."""
    tab = new_tab()
    tab.open(page.url)
    tab.wait(_SHOWN, 60.0)
    _moves(tab)
    assert "circle" in tab.text()
    assert "maneuver: circle" in tab.text()
    tab.run(_OPEN_PANEL)
    _change(tab, "limits.max_climb_m_s", "1.5", "refused: give the token first")
    tab.type("token", "wrong")
    tab.click("unlock")
    tab.wait(f"{_SAID}.includes('this is not the token')")
    _change(tab, "limits.max_climb_m_s", "1.5", "refused: give the token first")
    assert page.helper.changes.all_changes == []
    tab.type("token", page.page_socket.token)
    tab.click("unlock")
    tab.wait(f"{_SAID}.includes('can be changed')")
    _change(tab, "limits.max_climb_m_s", "1.5", "from 2 to 1.5")
    _change(tab, "limits.max_tilt_deg", "36", "more than 35, the value checked")
    _change(tab, "limits.max_tilt_deg", "steep", "must be a number")
    _change(tab, "limits.max_tilt_deg", "35", "no value was changed")
    tab.click("save")
    tab.wait(f"{_SAID}.includes('changed.yaml')")
    assert "  max_climb_m_s: 1.5  # was 2.0\n" in (folder / "changed.yaml").read_text()
    return tab


@pytest.mark.slow  # a browser takes more processor time than all other tests of this room
@pytest.mark.timeout(240)
def test_the_page(tmp_path):
    page = Page(tmp_path)
    later = None
    try:
        with chromium() as new_tab:
            urlopen(page.url, timeout=100).read()
            code, told = _refusal(page.url, Origin="http://example.com")
            assert (code, told) == (
                403,
                "another site, 'http://example.com', must not use the live page",
            )
            assert _refusal(page.url, Host="example.com")[0] == 403
            tab = _watch_and_change(new_tab, page, tmp_path)
            second = new_tab()
            second.open(page.url)
            second.wait(_SHOWN, 60.0)
            second.run(_OPEN_PANEL)
            second.wait(
                "document.querySelector('input[aria-label^=\"limits.max_climb\"]').value === '1.5'"
            )
            _change(second, "limits.max_climb_m_s", "1.0", "refused: give the token first")
            tab.click("undo")
            tab.wait(f"{_SAID}.includes('from 1.5 to 2')")
            assert len(page.helper.changes.all_changes) == 2
            page.end()
            tab.wait(
                "document.getElementById('live-over').innerText.includes('the flight is over')"
            )
            later = Page(address=f"127.0.0.1:{page.page_socket.port}")
            tab.wait("window.live && document.getElementById('live-over').hidden", 100.0)
            tab.wait(_SHOWN, 60.0)
            _moves(tab)
    finally:
        with suppress(OSError):
            page.end()
        if later is not None:
            later.end()
            later.helper._process.wait(30.0)
    assert page.notes == []
    assert (tmp_path / "live.log").read_text() == ""
