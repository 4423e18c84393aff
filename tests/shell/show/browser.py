"""A headless browser, driven over its DevTools protocol: what a person sees, hovers and clicks on a page."""

from __future__ import annotations

import base64
import itertools
import json
import os
import shutil
import signal
import subprocess
import time
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from ...support.waiting import PATIENCE_S

NAMES = ("chromium", "chromium-browser", "google-chrome", "chrome")
_FLAGS = (
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--hide-scrollbars",
    "--disable-background-networking", "--disable-component-update", "--disable-sync",
    "--enable-unsafe-swiftshader", "--use-angle=swiftshader", "--remote-debugging-port=0",
)  # fmt: skip
_ON_THE_WAY = (
    "navigated or closed",
    "context was destroyed",
    "Cannot find context",
    "Cannot find default execution context",
)
"""What the protocol answers while one page gives way to the next."""


class OnTheWay(Exception):
    """The page that was asked is giving way to another."""


def browser_found() -> str | None:
    """The path of a browser that these tests know, or None."""
    return next((path for path in map(shutil.which, NAMES) if path), None)


class Tab:
    """One page: open it, see what it logs, evaluate, move the mouse, press keys, take its picture."""

    def __init__(self, socket: Any) -> None:
        self._socket, self._number = socket, itertools.count(1)
        self.complaints: list[str] = []
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable")

    def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        """One command of the protocol; events that come meanwhile are noted."""
        number = next(self._number)
        self._socket.send(json.dumps({"id": number, "method": method, "params": parameters}))
        while True:
            answer = json.loads(self._socket.recv(timeout=PATIENCE_S))
            if answer.get("id") == number:
                if any(words in answer.get("error", {}).get("message", "") for words in _ON_THE_WAY):
                    raise OnTheWay(method)
                assert "error" not in answer, (method, answer["error"])
                return dict(answer["result"])
            self._note(answer)

    def _note(self, event: dict[str, Any]) -> None:
        about = event.get("params", {})
        if event.get("method") == "Runtime.exceptionThrown":
            self.complaints.append(json.dumps(about["exceptionDetails"])[:600])
        elif event.get("method") == "Log.entryAdded" and about["entry"]["level"] == "error":
            self.complaints.append(about["entry"]["text"])
        elif event.get("method") == "Runtime.consoleAPICalled" and about["type"] in ("error", "assert"):
            self.complaints.append(json.dumps(about["args"])[:600])
        elif event.get("method") == "Network.requestWillBeSent":
            url = about["request"]["url"]
            if not url.startswith(("file:", "data:", "blob:")):
                self.complaints.append(f"fetched {url[:120]}")

    def open(
        self, page: Path, width: int = 1280, height: int = 900, *, dark: bool = False, lively: bool = False
    ) -> None:
        """Load a page at a size in CSS pixels; lively: things may move by themselves."""
        self.call(
            "Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1,
            mobile=width < 500,
        )  # fmt: skip
        liked = {
            "prefers-color-scheme": "dark" if dark else "light",
            "prefers-reduced-motion": "no-preference" if lively else "reduce",
        }
        features = [{"name": name, "value": value} for name, value in liked.items()]
        self.call("Emulation.setEmulatedMedia", features=features)
        self.call("Page.navigate", url=page.resolve().as_uri())
        self.wait("document.readyState === 'complete'")

    def evaluate(self, expression: str) -> Any:
        """The value of a JavaScript expression."""
        answer = self.call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in answer, answer["exceptionDetails"]
        return answer["result"].get("value")

    def wait(self, expression: str, seconds: float = PATIENCE_S) -> None:
        """Until an expression is true, on this page or on the one that it gives way to."""
        end = time.monotonic() + seconds
        while True:
            with suppress(OnTheWay):
                if self.evaluate(expression):
                    return
            assert time.monotonic() < end, f"never came true: {expression}; {self.complaints}"
            time.sleep(0.05)

    def mouse(self, kind: str, x: float, y: float, **more: Any) -> None:
        """kind: mouseMoved, mousePressed, mouseReleased, mouseWheel."""
        self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, **more)

    def drag(self, x: float, y: float, by_x: float, by_y: float) -> None:
        """Press the left button, move, let go."""
        self.mouse("mousePressed", x, y, button="left", clickCount=1)
        for share in (0.3, 0.6, 1.0):
            self.mouse("mouseMoved", x + share * by_x, y + share * by_y, button="left", buttons=1)
        self.mouse("mouseReleased", x + by_x, y + by_y, button="left", clickCount=1)

    def click(self, x: float, y: float) -> None:
        """Where the pointer is."""
        self.mouse("mouseMoved", x, y)
        self.mouse("mousePressed", x, y, button="left", clickCount=1)
        self.mouse("mouseReleased", x, y, button="left", clickCount=1)

    def key(self, key: str, code: int = 0) -> None:
        """Press and let go."""
        for kind in ("keyDown", "keyUp"):
            self.call("Input.dispatchKeyEvent", type=kind, key=key, code=key, windowsVirtualKeyCode=code)

    def picture(self, path: Path, *, whole: bool = False) -> None:
        """Write a PNG of what is in sight, or of the whole page."""
        data = self.call("Page.captureScreenshot", format="png", captureBeyondViewport=whole)["data"]
        path.write_bytes(base64.b64decode(data))


@contextmanager
def a_tab(folder: Path) -> Iterator[Tab]:
    """A tab of a browser of our own; folder: for its profile."""
    from websockets.sync.client import connect

    path = browser_found()
    assert path is not None
    folder.mkdir(parents=True, exist_ok=True)
    process = subprocess.Popen(
        [path, *_FLAGS, f"--user-data-dir={folder}", "about:blank"],
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True,
    )  # fmt: skip
    try:
        port = _port(folder / "DevToolsActivePort", process)
        with urllib.request.urlopen(f"http://127.0.0.1:{port}/json", timeout=PATIENCE_S) as answer:
            address = next(t for t in json.load(answer) if t["type"] == "page")["webSocketDebuggerUrl"]
        # without pings: a busy machine answers them late
        with connect(address, max_size=None, open_timeout=PATIENCE_S, ping_interval=None) as socket:
            yield Tab(socket)
    finally:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()


def _port(file: Path, process: subprocess.Popen[bytes]) -> int:
    end = time.monotonic() + PATIENCE_S
    while time.monotonic() < end:
        if file.exists() and (words := file.read_text().split()):
            return int(words[0])
        assert process.poll() is None, "the browser ended at once"
        time.sleep(0.05)
    raise TimeoutError("the browser opened no port")
