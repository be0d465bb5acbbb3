"""A bare Starlette application behind the gate, on a real socket, and a browser's requests to it.

The application says yes to everything and keeps what reached it: what is refused, the gate refused.
"""

import asyncio
import http.client
import json
import threading
import time
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from socket import create_connection

import uvicorn
from robolink_cli.panel.guard.access import Access
from robolink_cli.panel.guard.connections import listening
from robolink_cli.panel.guard.gate import guarded
from robolink_cli.panel.guard.pairing import PairedTablets
from robolink_cli.panel.guard.people import Pins, Tries
from starlette.applications import Starlette
from starlette.responses import JSONResponse, PlainTextResponse
from starlette.routing import Route, WebSocketRoute
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from robolink.model import PersonRole, Secret

CELL = "line3"
OPEN_CELL = "bench"
"""It names no people."""
MEI, JON = "mei", "jon"
PEOPLE = {CELL: {MEI: PersonRole.ENGINEER, JON: PersonRole.OPERATOR}, OPEN_CELL: None}
PINS = {MEI: "204060718293", JON: "918273640155", "": "570913482260"}


class Clock:
    """A clock of its own, moved by a test."""

    def __init__(self):
        self.ahead_ns = 0

    def now_ns(self):
        return time.monotonic_ns() + self.ahead_ns

    def sleep(self, seconds):
        self.ahead_ns += int(seconds * 1e9)


@dataclass
class Notes:
    """What went on record."""

    kept: list[tuple[str, str, dict[str, object]]] = field(default_factory=list)

    def note(self, kind, cell, **facts):
        self.kept.append((kind, cell, facts))

    def whys(self):
        return [facts["why"] for kind, _, facts in self.kept if kind == "refused"]


@dataclass
class Answer:
    status: int
    headers: dict[str, str]
    cookies: list[str]
    body: bytes

    def json(self):
        return json.loads(self.body)


class Panel:
    """A served application, and what reached it."""

    def __init__(self, folder, *, host="127.0.0.1", tls=False, names=(), people=PEOPLE):
        self.folder, self.host = folder, host
        self.reached, self.notes, self.clock = [], Notes(), Clock()
        self.frames = []
        self._options = {"tls": tls, "names": names, "people": people}

    @contextmanager
    def served(self, port=0):
        """Serve on loopback whatever the guard believes to listen on: ``host``."""
        from robolink_cli.panel.guard.connections import Connections

        connections = Connections()
        listener = listening("127.0.0.1", port, connections)
        self.port = listener.getsockname()[1]
        self.access = Access(
            host=self.host,
            port=self.port,
            audit=self.notes,
            pins=Pins(self.folder / "pins"),
            tablets=PairedTablets(self.folder / "tablets"),
            tries=Tries(self.folder / "tries"),
            clock=self.clock,
            **self._options,
        )
        self.access.connections = connections
        app = guarded(self._application(), self.access)
        options = self.access.server_options()
        server = uvicorn.Server(
            uvicorn.Config(app, log_config=None, timeout_graceful_shutdown=1, **options)
        )
        thread = threading.Thread(target=lambda: asyncio.run(server.serve(sockets=[listener])))
        thread.start()
        try:
            while not server.started:
                time.sleep(0.005)
            yield self
        finally:
            server.should_exit = True
            thread.join(10)
            self.access.close()
            listener.close()
        assert not thread.is_alive()

    def _application(self):
        async def anything(request):
            body = await request.body()
            self.reached.append((request.method, request.url.path, body))
            tablet = self.access.tablet_of(request.scope)
            if request.url.path == "/seat":
                cell = json.loads(body)["cell"]
                self.access.seats.take(cell, tablet, moving=False)
            if request.url.path == "/token":
                return JSONResponse({"token": self.access.token_of(request.scope)})
            if request.url.path == "/big":
                return PlainTextResponse("x" * 50_000_000)
            headers = {"Access-Control-Allow-Origin": "*", "Server": "starlette"}
            return PlainTextResponse("yes", headers=headers)

        async def live(socket):
            await socket.accept()
            await socket.send_text(
                json.dumps({"t": "hello", "token": self.access.token_of(socket.scope)})
            )
            with suppress(Exception):
                while True:
                    frame = json.loads(await socket.receive_text())
                    self.frames.append(frame)
                    await socket.send_text(json.dumps({"t": "carried out", "frame": frame}))

        routes = [
            WebSocketRoute("/live", live),
            Route("/{path:path}", anything, methods=["GET", "HEAD", "POST", "PUT", "DELETE"]),
        ]
        return Starlette(routes=routes)

    def set_pins(self):
        for name, pin in PINS.items():
            Pins(self.folder / "pins").set(name, Secret(pin))

    def browser(self, **options):
        return Browser(self, **options)


class Browser:
    """A browser with one cookie jar, on a page of the panel unless a test says otherwise."""

    def __init__(self, panel, *, name="127.0.0.1", source="127.0.0.1"):
        self.panel, self.name, self.source = panel, name, source
        self.jar, self.token = {}, ""

    @property
    def host(self):
        return f"{self.name}:{self.panel.port}"

    def headers(self, **changed):
        """The headers of a browser; ``None`` leaves one out."""
        found = {
            "Host": self.host,
            "Origin": f"http://{self.host}",
            "Sec-Fetch-Site": "same-origin",
            "Content-Type": "application/json",
            "X-Robolink-Token": self.token,
            "Cookie": "; ".join(f"{key}={value}" for key, value in self.jar.items()),
        } | {key.replace("_", "-"): value for key, value in changed.items()}
        return {key: value for key, value in found.items() if value}

    def request(self, method, path, body=b"", **changed):
        line = http.client.HTTPConnection(
            "127.0.0.1", self.panel.port, timeout=10, source_address=(self.source, 0)
        )
        try:
            line.putrequest(method, path, skip_host=True, skip_accept_encoding=True)
            for key, value in self.headers(**changed).items():
                line.putheader(key, value)
            if method == "POST" and "Content_Length" not in changed:
                line.putheader("Content-Length", str(len(body)))
            line.endheaders(body)
            answer = line.getresponse()
            said = [value for key, value in answer.getheaders() if key.lower() == "set-cookie"]
            found = Answer(answer.status, dict(answer.getheaders()), said, answer.read())
        finally:
            line.close()
        for cookie in said:
            key, _, value = cookie.partition(";")[0].partition("=")
            self.jar[key] = value
        return found

    def get(self, path="/", **changed):
        """Open a page, as from the address bar."""
        asks = {"Origin": None, "Sec_Fetch_Site": "none", "Content_Type": None} | changed
        return self.request("GET", path, **asks)

    def post(self, path, said=None, **changed):
        return self.request("POST", path, json.dumps(said or {}).encode(), **changed)

    def load(self):
        """Load a page, with its token."""
        self.token = self.get("/token").json()["token"]
        return self

    def log_in(self, name=MEI, pin=None):
        return self.post("/login", {"name": name, "pin": PINS[name] if pin is None else pin})

    def pair(self, name=MEI, pin=None):
        return self.post("/pair", {"name": name, "pin": PINS[name] if pin is None else pin})

    @contextmanager
    def live(self, cell=CELL, **changed):
        """Open a WebSocket, as the page's script does."""
        options = {"Origin": f"http://{self.host}", "Sec_Fetch_Site": None} | changed
        headers = {
            key: value
            for key, value in self.headers(**options).items()
            if key not in ("Host", "Origin", "Content-Type", "X-Robolink-Token")
        }
        host = options.get("Host", self.host)
        with connect(
            f"ws://{host}/live?cell={cell}",
            sock=create_connection(("127.0.0.1", self.panel.port), 10, (self.source, 0)),
            origin=options["Origin"],
            additional_headers=headers,
            compression=None,
            open_timeout=10,
        ) as socket:
            yield Stream(socket)

    def refused(self, **changed):
        """Return the status with which a WebSocket is refused; 101 where it is not."""
        try:
            with self.live(**changed):
                return 101
        except InvalidStatus as error:
            return error.response.status_code


class Stream:
    """A WebSocket of a page."""

    def __init__(self, socket):
        self.socket = socket
        self.hello = self.next()

    def next(self, timeout=5):
        return json.loads(self.socket.recv(timeout=timeout))

    def send(self, **frame):
        self.socket.send(json.dumps(frame))

    def ask(self, **frame):
        self.send(**frame)
        return self.next()

    def closed(self):
        """Return the code with which it is closed."""
        with suppress(ConnectionClosed):
            while True:
                self.socket.recv(timeout=5)
        return self.socket.close_code
