"""A page in a headless browser of this machine: its pictures at a width, its print, and what scripts see."""

from __future__ import annotations

import asyncio
import base64
import json
import shutil
import tempfile
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tornado.httpclient import AsyncHTTPClient, HTTPRequest
from tornado.websocket import WebSocketClientConnection, websocket_connect

NAMES = ("chromium", "chromium-browser", "google-chrome", "chrome")
OPTIONS = (
    *(
        "--headless=new",
        "--no-sandbox",
        "--disable-gpu",
        "--no-first-run",
        "--disable-sync",
        "--disable-quic",
    ),
    *("--disable-background-networking", "--hide-scrollbars", "--remote-debugging-port=0"),
)
# longer pictures are cut
TALLEST = 6000
LARGEST_MESSAGE = 2**28
STARTS, ANSWERS = 60.0, 180.0


class BrowserError(RuntimeError):
    """There is no browser, or it did not do what it was asked for."""


def installed() -> str | None:
    """Give the path of a browser of this machine; None where there is none."""
    return next((found for name in NAMES if (found := shutil.which(name))), None)


@dataclass
class Tab:
    """A tab that is spoken to in the DevTools protocol; ``said`` is what its pages complained of."""

    socket: WebSocketClientConnection
    said: list[str] = field(default_factory=list)
    _count: int = 0

    async def call(self, method: str, **given: Any) -> dict[str, Any]:
        """Call a method of the protocol, and wait for its result.

        Raises
        ------
        BrowserError
            If the browser refuses or does not answer.
        """
        self._count += 1
        await self.socket.write_message(json.dumps({"id": self._count, "method": method, "params": given}))
        while True:
            text = await asyncio.wait_for(self.socket.read_message(), ANSWERS)
            if text is None:
                raise BrowserError("the browser ended")
            message = json.loads(text)
            self._note(message)
            if message.get("id") == self._count:
                if "error" in message:
                    raise BrowserError(f"{method}: {message['error']['message']}")
                return dict(message["result"])

    def _note(self, message: dict[str, Any]) -> None:
        held = message.get("params", {})
        if message.get("method") == "Runtime.exceptionThrown":
            thrown = held["exceptionDetails"]
            self.said.append(str(thrown.get("exception", {}).get("description", thrown["text"])))
        elif message.get("method") == "Log.entryAdded":
            self.said.append(str(held["entry"]["text"]))

    async def size(self, width: int, height: int, *, slower: float = 1.0, density: float = 1.0) -> None:
        """Take the size of a screen, in CSS pixels, and a processor that is so many times slower."""
        await self.call(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=density,
            mobile=width < 600,
        )
        await self.call("Emulation.setCPUThrottlingRate", rate=slower)

    async def show(self, page: Path) -> None:
        """Open a page anew, and wait until it has loaded and its maps are drawn."""
        await self.call("Page.navigate", url=page.resolve().as_uri())
        await self.script(
            "new Promise((done) => { const look = () => document.readyState === 'complete' && "
            "[...document.querySelectorAll('.explorer')].every((one) => one.dataset.ready) "
            "? done(true) : setTimeout(look, 10); look(); })"
        )

    async def script(self, code: str) -> Any:
        """Give the value of an expression in the page; of a promise, what it comes to.

        Raises
        ------
        BrowserError
            If it throws.
        """
        found = await self.call("Runtime.evaluate", expression=code, awaitPromise=True, returnByValue=True)
        if "exceptionDetails" in found:
            raise BrowserError(str(found["exceptionDetails"]))
        return found["result"].get("value")

    async def pictures(self, stem: Path) -> list[Path]:
        """Write pictures of the whole page, one below the other, as PNG."""
        height = int(await self.script("document.documentElement.scrollHeight"))
        width = int(await self.script("innerWidth"))
        paths = []
        for number, top in enumerate(range(0, height, TALLEST)):
            clip = {"x": 0, "y": top, "width": width, "height": min(TALLEST, height - top), "scale": 1}
            shot = await self.call("Page.captureScreenshot", clip=clip, captureBeyondViewport=True)
            paths.append(stem.with_name(f"{stem.name}-{number}.png"))
            paths[-1].write_bytes(base64.b64decode(shot["data"]))
        return paths

    async def picture(self, chosen: str, path: Path) -> Path:
        """Write a picture of the first element that a selector of CSS chooses, as PNG."""
        box = await self.script(
            f"(() => {{ const box = document.querySelector({json.dumps(chosen)}).getBoundingClientRect(); "
            "return {x: box.x + scrollX, y: box.y + scrollY, width: box.width, height: box.height}; })()"
        )
        shot = await self.call("Page.captureScreenshot", clip={**box, "scale": 1}, captureBeyondViewport=True)
        path.write_bytes(base64.b64decode(shot["data"]))
        return path

    async def print(self, path: Path) -> Path:
        """Print the page as PDF, on the paper that it asks for."""
        found = await self.call(
            "Page.printToPDF", printBackground=True, preferCSSPageSize=True, displayHeaderFooter=False
        )
        path.write_bytes(base64.b64decode(found["data"]))
        return path


@asynccontextmanager
async def tab() -> AsyncIterator[Tab]:
    """Start a browser with one empty tab; it ends with the block.

    Raises
    ------
    BrowserError
        If there is none, or it does not start.
    """
    path = installed()
    if path is None:
        raise BrowserError(f"there is no browser: none of {', '.join(NAMES)}")
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        process = await asyncio.create_subprocess_exec(
            *(path, *OPTIONS, f"--user-data-dir={folder}", "about:blank"),
            stdout=asyncio.subprocess.DEVNULL,
            stderr=asyncio.subprocess.DEVNULL,
        )
        try:
            port = await asyncio.wait_for(_port(Path(folder) / "DevToolsActivePort"), STARTS)
            asked = HTTPRequest(f"http://127.0.0.1:{port}/json/new?about:blank", method="PUT", body="")
            about = json.loads((await AsyncHTTPClient().fetch(asked)).body)
            socket = await websocket_connect(about["webSocketDebuggerUrl"], max_message_size=LARGEST_MESSAGE)
            found = Tab(socket)
            for domain in ("Page", "Runtime", "Log"):
                await found.call(f"{domain}.enable")
            try:
                yield found
            finally:
                socket.close()
        except TimeoutError:
            raise BrowserError(f"{path} does not answer") from None
        finally:
            process.terminate()
            await process.wait()


async def _port(path: Path) -> int:
    """Wait for the port that the browser listens at."""
    while True:
        if path.exists() and (lines := path.read_text().splitlines()):
            return int(lines[0])
        await asyncio.sleep(0.05)
