"""A panel that follows a test, not a cell: it sends the frames that a test wants, when it wants.

What the script of a page does is looked at here, frame by frame. Whole jobs run against the panel
itself (``test_whole_change.py``).
"""

import asyncio
import json
import threading
import time
from importlib.resources import files

import uvicorn
from robolink_cli.panel.guard.gate import CONTENT_SECURITY
from robolink_cli.panel.pages import HERE, Pages, Watcher
from starlette.applications import Starlette
from starlette.responses import HTMLResponse, JSONResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocketDisconnect, WebSocketState

from tests.panel.browser import samples

KINDS = {"css": "text/css", "js": "text/javascript", "svg": "image/svg+xml"}
OPERATOR = Watcher(seat=HERE, who="Chen", role="operator")


class ScriptedPanel:
    """Serves pages in a thread of its own; a context manager.

    Attributes:
        frames: What came by streams, with the moment: ``(s, frame)``.
        posts: What was posted: ``(s, path, body)``.
        view: What is shown.
        watcher: Who looks.
        frozen: Whether nothing is sent or answered.
        beats_only: Whether no screen is sent, so that a page stays as it was loaded.
        answers: What a STOP is answered with; ``None`` for nothing.
        server: The name that the server gives itself.
        documents: Further pages, by their paths.
    """

    def __init__(self):
        self.frames, self.posts = [], []
        self.view, self.watcher = samples.views("en")["touch"], OPERATOR
        self.frozen, self.answers, self.server = False, "stopped", "one"
        self.age_ms = 200
        self.documents = {}
        self.beats_only = False
        self.pages = Pages()
        self.port = 0
        self._sockets = set()
        self._loop = None

    @property
    def url(self):
        """The cell's page."""
        return f"http://127.0.0.1:{self.port}/cell/line3"

    def __enter__(self):
        self.start()
        return self

    def __exit__(self, *_):
        self.kill()

    def start(self):
        """Serve, at the same port as before."""
        app = Starlette(
            routes=[
                Route("/cell/{cell}", self._cell),
                Route("/static/{name}", self._static),
                Route("/{path:path}", self._post, methods=["POST"]),
                Route("/{path:path}", self._document),
                WebSocketRoute("/live", self._live),
            ]
        )
        config = uvicorn.Config(
            app, host="127.0.0.1", port=self.port, log_config=None, ws="websockets-sansio",
            timeout_graceful_shutdown=1,
        )  # fmt: skip
        self._server = uvicorn.Server(config)
        self._thread = threading.Thread(target=self._server.run, daemon=True)
        self._thread.start()
        until(lambda: self._server.started)
        self.port = self._server.servers[0].sockets[0].getsockname()[1]

    def kill(self):
        """End at once, as a killed process does."""
        self._server.force_exit = self._server.should_exit = True
        self._thread.join(10)
        assert not self._thread.is_alive()

    def show(self, view):
        """Show another view, at once."""
        self.view = view
        for loop, event in tuple(self._sockets):
            loop.call_soon_threadsafe(event.set)

    def of(self, kind):
        """Return the frames of a kind."""
        return [frame for _, frame in self.frames if frame["t"] == kind]

    def last_s(self, kind):
        """Return when the last frame of a kind came."""
        return max((at for at, frame in self.frames if frame["t"] == kind), default=None)

    # ---- Answers

    def parts(self):
        return self.pages.screen(self.view, self.watcher)

    async def _cell(self, request):
        page = self.pages.page(
            "cell", self.watcher, cell=request.path_params["cell"], parts=self.parts(),
            number=self.view.number, token="T",
        )  # fmt: skip
        return _page(page)

    async def _document(self, request):
        return _page(self.documents[request.url.path])

    async def _static(self, request):
        name = request.path_params["name"]
        content = files("robolink_cli.panel").joinpath("static", name).read_bytes()
        return Response(content, media_type=KINDS[name.rpartition(".")[2]])

    async def _post(self, request):
        body = await request.json()
        self.posts.append((time.monotonic(), request.url.path, body))
        while self.frozen:
            await asyncio.sleep(0.02)
        if request.url.path not in ("/stop", "/stop-all"):
            return JSONResponse({"why": "Not here."}, 403)
        while self.answers is None:
            await asyncio.sleep(0.02)
        return JSONResponse(self._stopped(body["press"]))

    def _stopped(self, press):
        return {
            "t": "stopped",
            "press": press,
            "outcome": self.answers,
            "text": "line3 is at rest.",
        }

    async def _live(self, socket):
        await socket.accept()
        news = asyncio.Event()
        key = (asyncio.get_running_loop(), news)
        self._sockets.add(key)
        try:
            await asyncio.gather(self._hear(socket), self._tell(socket, news))
        except (WebSocketDisconnect, RuntimeError, OSError):
            pass
        finally:
            self._sockets.discard(key)

    async def _hear(self, socket):
        while True:
            frame = json.loads(await socket.receive_text())
            self.frames.append((time.monotonic(), frame))
            if frame["t"] == "stop" and self.answers is not None and not self.frozen:
                await socket.send_json(self._stopped(frame["press"]))

    async def _tell(self, socket, news):
        await socket.send_json({"t": "hello", "server": self.server, "token": "T"})
        shown: dict[str, str] = {}
        number = None
        while socket.client_state is WebSocketState.CONNECTED:
            news.clear()
            if not self.frozen:
                parts = self.parts()
                changed = {k: v for k, v in parts.named().items() if shown.get(k) != v}
                if (changed or number != self.view.number) and not self.beats_only:
                    shown, number = parts.named(), self.view.number
                    await socket.send_json(
                        {"t": "screen", "screen": parts.screen, "number": number, "parts": changed}
                    )
                at_ms = round(1000 * time.monotonic())
                await socket.send_json(
                    {"t": "beat", "age_ms": self.age_ms, "status": {}, "at_ms": at_ms}
                )
            try:
                await asyncio.wait_for(news.wait(), 0.2)
            except TimeoutError:
                continue


def _page(text):
    return HTMLResponse(text, headers={"Content-Security-Policy": CONTENT_SECURITY})


def until(holds, within_s=15.0, told=lambda: "nothing"):
    """Wait until something holds; fail where it does not, with what the page told meanwhile."""
    end_s = time.monotonic() + within_s
    while not holds():
        assert time.monotonic() < end_s, f"it did not come to pass; told: {told()}"
        time.sleep(0.01)
