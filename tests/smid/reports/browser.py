"""A headless Chromium, told what to do over its DevTools protocol; nothing but the standard library is needed."""

import base64
import json
import os
import shutil
import subprocess
import tempfile

PHONE, DESKTOP = 390, 1100  # pixels
OPTIONS = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-background-networking",
    "--disable-component-update",
    "--no-first-run",
    "--remote-debugging-pipe",
)


class Browser:
    """One process for many pages: a context manager.

    The protocol goes through two pipes, which Chromium knows as files 3 and 4; a zero byte ends each message.
    """

    def __init__(self, program):
        self._profile = tempfile.mkdtemp()
        told, self._tell = os.pipe()
        self._hear, answers = os.pipe()
        self._process = subprocess.Popen(
            [
                *("bash", "-c", f'exec "$0" "$@" 3<&{told} 4>&{answers}', program),
                *(*OPTIONS, f"--user-data-dir={self._profile}", "about:blank"),
            ],
            pass_fds=(told, answers),
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        os.close(told)
        os.close(answers)
        self._number, self._rest, self._session, self._events = 0, b"", None, []

    def __enter__(self):
        page = next(t for t in self.ask("Target.getTargets")["targetInfos"] if t["type"] == "page")
        self._session = self.ask("Target.attachToTarget", targetId=page["targetId"], flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.ask(f"{domain}.enable")
        return self

    def __exit__(self, *_error):
        self._process.kill()
        self._process.wait()
        os.close(self._tell)
        os.close(self._hear)
        shutil.rmtree(self._profile, ignore_errors=True)

    def ask(self, method, **parameters):
        """Send a command and return its answer; what happens meanwhile is kept."""
        self._number += 1
        message = {"id": self._number, "method": method, "params": parameters}
        if self._session:
            message["sessionId"] = self._session
        os.write(self._tell, json.dumps(message).encode() + b"\0")
        while (answer := self._read()).get("id") != self._number:
            self._events.append(answer)
        assert "error" not in answer, answer
        return answer["result"]

    def _read(self):
        while b"\0" not in self._rest:
            got = os.read(self._hear, 1 << 20)
            assert got, "Chromium has gone"
            self._rest += got
        message, self._rest = self._rest.split(b"\0", 1)
        return json.loads(message)

    def open(self, path, width=DESKTOP, scheme="light"):
        """Load a file, or an address, and forget the one before."""
        self._events.clear()
        self.ask("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])
        size = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": width == PHONE}
        self.ask("Emulation.setDeviceMetricsOverride", **size)
        self.ask("Page.navigate", url=path if isinstance(path, str) else path.as_uri())
        while not self.events("Page.loadEventFired"):
            self._events.append(self._read())

    def events(self, *methods):
        """Return what was told under these names since the page was opened."""
        return [event["params"] for event in self._events if event.get("method") in methods]

    def value(self, script):
        """Return what an expression comes to on the page."""
        return self.ask("Runtime.evaluate", expression=script, returnByValue=True)["result"].get("value")

    def picture(self):
        """Return the whole page as PNG, to look at when a test fails."""
        return base64.b64decode(self.ask("Page.captureScreenshot", captureBeyondViewport=True)["data"])
