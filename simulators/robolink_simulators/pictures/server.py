"""Serves the pictures of a drawn camera by HTTP, as an ordinary network camera does.

``http://127.0.0.1:PORT/TOKEN/snapshot.jpg`` (also ``.png`` and ``.pgm``) is exposed when it is
asked for. ``/TOKEN/stream.mjpg`` sends one picture after the other, whether or not anybody reads
them: what was not read waits in the buffers of the connection and gets old there, as with a real
stream. JPEG needs Pillow.
"""

import os
import select
import threading
from collections.abc import Callable
from contextlib import suppress
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from socket import AF_INET, AF_INET6, MSG_PEEK, SHUT_RDWR, SO_REUSEADDR, SOL_SOCKET, socket
from time import monotonic
from typing import Any, Final
from urllib.parse import urlsplit

import numpy as np

from robolink.interrupts import ClosedAtExit
from robolink_simulators.control.cell import drawn_token, is_token
from robolink_simulators.hosting.addresses import cannot_listen, require_loopback
from robolink_simulators.pictures.camera import DrawnCamera, DrawnFrame
from robolink_simulators.pictures.picture_files import ENCODERS

STREAM: Final = "stream.mjpg"
SNAPSHOT: Final = "snapshot"
MOST_CLIENTS: Final = 16

_SILENCE_S: Final = 60.0
_STREAM_PERIOD_S: Final = 0.2
_NOTE_PERIOD_S: Final = 0.02
_SLICE_S: Final = 0.1
_BOUNDARY: Final = "picture"
_SMALLEST: Final = np.zeros((8, 8), np.uint8)
"""Encoded once before a stream begins: whether Pillow is there shows before its head is sent."""


class PictureServer(ClosedAtExit):
    """Serves one camera until it is closed.

    Args:
        camera: The camera.
        address: Host and port to bind to; port 0 takes a free one.
        allow_remote: Whether an address that other machines can reach is taken.
        token: What its URL holds; drawn when it is left out.

    Attributes:
        requests: How many pictures were asked for.

    Raises:
        ConfigError: The address is not loopback and ``allow_remote`` is off.
        ConnectError: The port is taken, or the address is not this machine's.

    Example:
        >>> from urllib.request import urlopen
        >>> from robolink_simulators.epson.device import EpsonSimulator
        >>> from robolink_simulators.pictures.camera import DrawnCamera
        >>> from robolink_simulators.pictures.server import PictureServer
        >>> with PictureServer(DrawnCamera(EpsonSimulator())) as server:
        ...     urlopen(server.url("pgm")).read(2)
        b'P5'
    """

    def __init__(
        self,
        camera: DrawnCamera,
        address: tuple[str, int] = ("127.0.0.1", 0),
        *,
        allow_remote: bool = False,
        token: str | None = None,
    ) -> None:
        require_loopback(address[0], allow_remote=allow_remote)
        self.requests = 0
        self._token = drawn_token() if token is None else token
        self._host = address[0]
        self._camera = camera
        self._ends = threading.Event()
        try:
            self._http = _Port(address, camera, self._token, self._ends, self._count)
        except (OSError, OverflowError) as error:
            raise cannot_listen(*address, error) from error
        self._threads = (
            threading.Thread(
                target=self._http.serve_forever, args=(_SLICE_S,), name="pictures", daemon=True
            ),
            threading.Thread(target=self._note, name="picture places", daemon=True),
        )
        for thread in self._threads:
            thread.start()

    def url(self, ending: str = "jpg") -> str:
        """Return where a picture is to be had, as ``jpg``, ``png`` or ``pgm``."""
        return f"{self._base}/{SNAPSHOT}.{ending}"

    @property
    def stream_url(self) -> str:
        """Where one picture follows the other."""
        return f"{self._base}/{STREAM}"

    def document(self) -> dict[str, object]:
        """Return where pictures are to be had, ready for JSON."""
        width, height = self._camera.size_px
        urls = {ending: self.url(ending) for ending in ENCODERS}
        return {
            "url": urls["pgm"],
            "urls": {**urls, "stream": self.stream_url},
            "size_px": [width, height],
        }

    @property
    def _base(self) -> str:
        host = f"[{self._host}]" if ":" in self._host else self._host
        return f"http://{host}:{self._http.server_address[1]}/{self._token}"

    def close(self) -> None:
        """Stop serving, and end every connection. Idempotent."""
        if not self._ends.is_set():
            self._ends.set()
            self._http.shutdown()
            self._http.end_connections()
            self._http.server_close()
            for thread in self._threads:
                thread.join()

    def _count(self) -> None:
        self.requests += 1

    def _note(self) -> None:
        """Note where everything is, for as long as pictures are late by seconds."""
        while not self._ends.wait(_NOTE_PERIOD_S):
            self._camera.note()


class _Port(ThreadingHTTPServer):
    daemon_threads = True
    block_on_close = False
    request_queue_size = 64

    def __init__(
        self,
        address: tuple[str, int],
        camera: DrawnCamera,
        token: str,
        ends: threading.Event,
        count: Callable[[], None],
    ) -> None:
        self.address_family = AF_INET6 if ":" in address[0] else AF_INET
        self.camera, self.token, self.ends, self.count = camera, token, ends, count
        self._open = set[socket]()
        self._counting = threading.Lock()
        super().__init__(address, _Client)

    def server_bind(self) -> None:
        """Bind without looking up this machine's name, which may take seconds."""
        if os.name == "posix":  # on Windows it would let two programs share the port
            self.socket.setsockopt(SOL_SOCKET, SO_REUSEADDR, 1)
        self.socket.bind(self.server_address)
        self.server_address = self.socket.getsockname()

    def process_request(self, request: Any, client_address: Any) -> None:  # noqa: ANN401 - as there
        """Serve a connection; one too many is closed unanswered, as small cameras do."""
        with self._counting:
            room = len(self._open) < MOST_CLIENTS
            if room:
                self._open.add(request)
        if room:
            super().process_request(request, client_address)
        else:
            super().shutdown_request(request)

    def shutdown_request(self, request: Any) -> None:  # noqa: ANN401 - as there
        """End a connection."""
        with self._counting:
            self._open.discard(request)
        super().shutdown_request(request)

    def end_connections(self) -> None:
        """End open connections; their threads notice it."""
        with self._counting:
            still_open = tuple(self._open)
        for connection in still_open:
            with suppress(OSError):  # it has ended already
                connection.shutdown(SHUT_RDWR)

    def handle_error(self, request: Any, client_address: Any) -> None:  # noqa: ANN401 - as there
        """Ignore a client that disconnects in the middle."""


class _Client(BaseHTTPRequestHandler):
    server: _Port
    protocol_version = "HTTP/1.1"
    server_version = "camera"
    sys_version = ""
    timeout = _SILENCE_S
    disable_nagle_algorithm = True

    def do_GET(self) -> None:
        """Answer a question for a picture, or begin a stream."""
        try:
            token, _, name = urlsplit(self.path).path.strip("/").partition("/")
        except ValueError:
            self.send_error(HTTPStatus.BAD_REQUEST)
            return
        if not is_token(token, self.server.token):
            self.send_error(HTTPStatus.FORBIDDEN)
        elif name == STREAM:
            self._stream()
        else:
            stem, _, ending = name.partition(".")
            if stem == SNAPSHOT and ending in ENCODERS:
                self._snapshot(ending)
            else:
                self.send_error(HTTPStatus.NOT_FOUND)

    def log_message(self, *_: object) -> None:
        """Print nothing: the URL holds the token."""

    def _snapshot(self, ending: str) -> None:
        media_type, encode = ENCODERS[ending]
        self.server.count()
        frame = self.server.camera.expose()
        if not self._waited(frame) or frame.faults.gone:
            self.close_connection = True
            return
        try:
            data = encode(frame.grey)
        except ImportError:
            self.send_error(HTTPStatus.NOT_IMPLEMENTED, "JPEG needs Pillow")
            return
        self.send_response(HTTPStatus.OK)
        self.send_header("Content-Type", media_type)
        self.send_header("Content-Length", str(len(data)))
        self.send_header("Cache-Control", "no-store")
        self.end_headers()
        self.wfile.write(_delivered(frame, data))
        if frame.faults.halved:
            self.close_connection = True

    def _stream(self) -> None:
        _, encode = ENCODERS["jpg"]
        self.close_connection = True
        try:
            encode(_SMALLEST)
        except ImportError:
            self.send_error(HTTPStatus.NOT_IMPLEMENTED, "JPEG needs Pillow")
            return
        self.send_response(HTTPStatus.OK)
        self.send_header("Content-Type", f"multipart/x-mixed-replace; boundary={_BOUNDARY}")
        self.send_header("Cache-Control", "no-store")
        self.end_headers()
        due_s = monotonic()
        while not self.server.ends.wait(max(0.0, due_s - monotonic())):
            due_s = max(due_s + _STREAM_PERIOD_S, monotonic())
            self.server.count()
            frame = self.server.camera.expose()
            if not self._waited(frame) or frame.faults.gone:
                return
            data = encode(frame.grey)
            head = (
                f"--{_BOUNDARY}\r\nContent-Type: image/jpeg\r\nContent-Length: {len(data)}\r\n\r\n"
            )
            self.wfile.write(head.encode("ascii") + _delivered(frame, data) + b"\r\n")

    def _waited(self, frame: DrawnFrame) -> bool:
        """Wait as long as the camera is slow; ``False`` if the client left or the server ends."""
        until_s = monotonic() + frame.faults.slow_s
        while (left_s := until_s - monotonic()) > 0:
            if self.server.ends.is_set() or self._left(min(left_s, _SLICE_S)):
                return False
        return True

    def _left(self, seconds: float) -> bool:
        """Wait, and return whether the client has gone meanwhile."""
        readable, _, _ = select.select((self.connection,), (), (), seconds)
        if not readable:
            return False
        if self.connection.recv(1, MSG_PEEK) == b"":
            return True
        self.server.ends.wait(seconds)  # it sends the next request already
        return False


def _delivered(frame: DrawnFrame, data: bytes) -> bytes:
    return data[: len(data) // 2] if frame.faults.halved else data
