"""A panel in a process of its own, and a tablet that opens its pages."""

import asyncio
import http.client
import json
import subprocess
import sys
import time
from contextlib import contextmanager

import websockets

PIN = "41827364"


@contextmanager
def panel(cells_file, *arguments):
    """Run a panel for the block; yield its process and the port."""
    process = subprocess.Popen(
        [
            *(sys.executable, "-m", "robolink_cli", "--json", "panel"),
            *("--cells", str(cells_file), "--listen", "127.0.0.1:0", *arguments),
        ],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
    )
    assert process.stdout is not None
    try:
        with process.stdout:
            told = json.loads(process.stdout.readline())
            yield process, int(told["url"].rstrip("/").rpartition(":")[2])
            process.terminate()
            process.wait(60)
    finally:
        process.kill()
        process.wait()


class Tablet:
    """A browser with its cookies.

    Args:
        port: Of the panel.
    """

    def __init__(self, port):
        self.port, self.cookies, self.token = port, {}, ""
        self.ask("GET", "/")

    @property
    def origin(self):
        return f"http://127.0.0.1:{self.port}"

    @property
    def cookie(self):
        return "; ".join(f"{name}={value}" for name, value in self.cookies.items())

    def ask(self, method, path, said=None, *, token=None):
        line = http.client.HTTPConnection("127.0.0.1", self.port, timeout=30)
        headers = {"Cookie": self.cookie, "Sec-Fetch-Site": "same-origin"}
        if said is not None:
            headers |= {"Content-Type": "application/json", "Origin": self.origin}
            headers["X-Robolink-Token"] = self.token if token is None else token
        line.request(method, path, None if said is None else json.dumps(said), headers)
        answer = line.getresponse()
        data = answer.read()
        for name, value in answer.getheaders():
            if name.lower() == "set-cookie":
                key, _, rest = value.partition(";")[0].partition("=")
                self.cookies[key] = rest
        line.close()
        return answer.status, data

    async def post(self, path, **said):
        status, data = await asyncio.to_thread(self.ask, "POST", path, said)
        return status, json.loads(data or b"{}")

    def login(self, pin=PIN):
        return self.ask("POST", "/login", {"name": "", "pin": pin})[0]

    def live(self, cell=""):
        return LiveTablet(self, cell)


class LiveTablet:
    """One page with its stream: it answers beats, and keeps what it was shown.

    Args:
        tablet: Whose.
        cell: Which cell; empty for all.
    """

    def __init__(self, tablet, cell):
        self.tablet, self.cell = tablet, cell
        self.screen, self.number, self.parts = "", 0, {}
        self.beats, self.said = [], []
        self.news = asyncio.Event()

    async def __aenter__(self):
        where = f"?cell={self.cell}" if self.cell else ""
        self.line = await websockets.connect(
            f"ws://127.0.0.1:{self.tablet.port}/live{where}",
            origin=self.tablet.origin,
            additional_headers={"Cookie": self.tablet.cookie},
        )
        self.hello = json.loads(await self.line.recv())
        self.tablet.token = self.hello["token"]
        self.task = asyncio.ensure_future(self._follow())
        return self

    async def __aexit__(self, *_):
        self.task.cancel()
        await asyncio.gather(self.task, return_exceptions=True)
        await self.line.close()

    async def _follow(self):
        async for text in self.line:
            frame = json.loads(text)
            match frame["t"]:
                case "screen":
                    self.screen, self.number = frame["screen"], frame["number"]
                    self.parts |= frame["parts"]
                case "beat":
                    self.beats.append((time.monotonic(), frame))
                    await self.line.send('{"t":"pong"}')
                case _:
                    self.said.append(frame)
            self.news.set()

    async def send(self, **frame):
        await self.line.send(json.dumps(frame))

    async def press(self, action, value="", number=None, press="p"):
        number = self.number if number is None else number
        await self.send(t="press", number=number, action=action, value=value, press=press)

    async def press_until(self, holds, action, value="", within_s=60.0):
        """Press until something holds: what is pressed as a screen appears does nothing."""
        until_s = time.monotonic() + within_s
        while time.monotonic() < until_s:
            await asyncio.sleep(0.35)
            await self.press(action, value)
            try:
                return await self.until(holds, 0.7)
            except TimeoutError:
                continue
        raise AssertionError((self.screen, self.parts))

    async def until(self, holds, within_s=60.0):
        """Wait until something holds of what is shown."""
        async with asyncio.timeout(within_s):
            while not (found := holds(self)):
                self.news.clear()
                await self.news.wait()
        return found

    async def answer(self, kind, press, within_s=60.0):
        """Wait for what became of a press."""
        return await self.until(
            lambda page: next(
                (it for it in page.said if it["t"] == kind and it.get("press") == press), None
            ),
            within_s,
        )
