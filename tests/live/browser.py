"""Headless Chromium (Debian's package), driven by its DevTools protocol."""

import json
import shutil
import subprocess
import tempfile
import time
from contextlib import ExitStack, contextmanager
from pathlib import Path
from urllib.request import Request, urlopen

from websockets.sync.client import connect

CHROMIUM = shutil.which("chromium")


class Tab:
    """One tab."""

    def __init__(self, socket):
        self._socket, self._number = socket, 0

    def ask(self, method, **parameters):
        self._number += 1
        self._socket.send(json.dumps({"id": self._number, "method": method, "params": parameters}))
        while True:
            message = json.loads(self._socket.recv(timeout=20))
            if message.get("id") == self._number:
                return message.get("result", {})

    def run(self, code):
        """The value of a JavaScript expression."""
        told = self.ask("Runtime.evaluate", expression=code, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in told, told["exceptionDetails"]
        return told.get("result", {}).get("value")

    def wait(self, code, seconds=20.0):
        """Wait until an expression is true; a page that is loading may lack what it names."""
        deadline = time.monotonic() + seconds
        while not (value := self.run(f"(() => {{ try {{ return {code} }} catch {{}} }})()")):
            assert time.monotonic() < deadline, f"{code}; page: {self.text()[-600:]}"
            time.sleep(0.1)
        return value

    def text(self):
        return self.run("document.body.innerText") or ""

    def open(self, url):
        self.ask("Page.navigate", url=url)

    def type(self, label, text):
        """Replace the text of the input with this label."""
        self.run(
            f"""(() => {{ const field = document.querySelector('input[aria-label^="{label}"]');
            Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, 'value')
                .set.call(field, {json.dumps(text)});
            field.dispatchEvent(new Event('input', {{bubbles: true}})); }})()"""
        )

    def click(self, name):
        self.run(f"document.getElementById('live-{name}').click()")


@contextmanager
def chromium():
    """Yields a function that opens a new tab."""
    with ExitStack() as sockets, tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        process = subprocess.Popen(
            [
                CHROMIUM,
                "--headless=new",
                "--no-sandbox",
                "--disable-gpu",
                "--disable-extensions",
                "--disable-background-networking",
                "--no-first-run",
                f"--user-data-dir={folder}",
                "--remote-debugging-port=0",
                "about:blank",
            ],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        try:
            port_file = Path(folder, "DevToolsActivePort")
            deadline = time.monotonic() + 30.0
            while not port_file.exists() or not port_file.read_text().strip():
                assert time.monotonic() < deadline, "chromium does not start"
                time.sleep(0.1)
            port = port_file.read_text().split()[0]

            def new_tab():
                asked = Request(f"http://127.0.0.1:{port}/json/new?about:blank", method="PUT")
                with urlopen(asked, timeout=10) as answer:
                    url = json.load(answer)["webSocketDebuggerUrl"]
                tab = Tab(sockets.enter_context(connect(url, max_size=None)))
                tab.ask("Page.enable")
                return tab

            yield new_tab
        finally:
            sockets.close()
            process.terminate()
            process.wait(20)
