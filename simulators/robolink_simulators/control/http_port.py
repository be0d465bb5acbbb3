"""The HTTP of the control API: connections, requests, and malformed requests.

At most :data:`MOST_CLIENTS` are connected at a time, and each request is at most
:data:`LONGEST_REQUEST` bytes. A connection ends by itself on which no whole request came for a
minute, or whose client takes no answer for so long. Where all places are taken, who has asked
nothing yet makes way for a newcomer: so nobody who is silent, or sends a byte now and then, keeps
others out.

A browser on this machine asks what any page tells it to. Such a request names the page in its
``Origin``, and is refused; one that a page of another name sends here after that name was made to
lead here (DNS rebinding) has that name in its ``Host``. Where other machines are served, too, these
call this one as they like, so only ``Origin`` is looked at.
"""

import io
import json
import os
import threading
from collections.abc import Callable
from contextlib import suppress
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from math import inf
from socket import AF_INET, AF_INET6, SHUT_RDWR, SO_REUSEADDR, SOL_SOCKET, socket
from time import monotonic
from typing import Any, Final, NamedTuple

from robolink.messages import tr
from robolink_simulators.hosting.addresses import is_this_machine, require_loopback

SCHEMA: Final = "robolink/control/1"
"""Schema of every answer except the API's own description."""

MOST_CLIENTS: Final = 64
MOST_TURNED_AWAY: Final = 16
"""Number of further connections that receive the answer that no place is free."""

LONGEST_REQUEST: Final = 65_536
_SILENCE_S: Final = 60.0
_TURNED_AWAY_S: Final = 5.0

_BEFORE_ASKING_S: Final = 5.0
"""Time in seconds after which a connection without a request gives up its place if all are taken.
"""


class ApiReply(NamedTuple):
    """The answer to a request.

    Attributes:
        status: How it went.
        document: What is told.
        allow: Where it was the method that is refused, those that are not.
    """

    status: HTTPStatus
    document: dict[str, Any]
    allow: tuple[str, ...] = ()


def error_document(what: str, remedy: str = "") -> dict[str, Any]:
    """Return the answer to a request that is not carried out."""
    return {"schema": SCHEMA, "ok": False, "error": what, "remedy": remedy}


def no_request(status: HTTPStatus) -> tuple[str, str]:
    """Return what happened and what to do next."""
    return (
        tr("What came is no request that is answered here: {cause}.", cause=status.phrase),
        tr("Send GET or POST, as docs/control-api.md explains."),
    )


class HttpPort(ThreadingHTTPServer):
    """Serves each connection in a thread of its own, with a limit on their number.

    Args:
        address: Host and port to bind to.
        answered: Returns what a request is answered with, given its method, target and body.
        allow_remote: Whether other machines may ask.

    Raises:
        ConfigError: The address is not loopback and ``allow_remote`` is off.
        OSError: The port is taken, or the address is not this machine's.
        OverflowError: There is no such port.
    """

    daemon_threads = True
    block_on_close = False
    request_queue_size = 512  # a client that finds no room retries only a second later

    def __init__(
        self,
        address: tuple[str, int],
        answered: Callable[[str, str, bytes], ApiReply],
        *,
        allow_remote: bool = False,
    ) -> None:
        require_loopback(address[0], allow_remote=allow_remote)
        self.allow_remote = allow_remote
        self.address_family = AF_INET6 if ":" in address[0] else AF_INET
        self.answered = answered
        self._served = dict[socket, float]()  # start of the silence of each
        self._turned_away = set[socket]()
        self._counting = threading.Lock()
        super().__init__(address, _Served)

    def server_bind(self) -> None:
        """Bind without looking up this machine's name, which may take seconds."""
        if os.name == "posix":
            # Without it nobody can listen here for a minute if a client was connected last. On
            # Windows it would let two programs share the port.
            self.socket.setsockopt(SOL_SOCKET, SO_REUSEADDR, 1)
        self.socket.bind(self.server_address)
        self.server_address = self.socket.getsockname()

    def process_request(self, request: Any, client_address: Any) -> None:  # noqa: ANN401 - as there
        """Serve a connection, or refuse it if there are too many; a flood is closed unanswered."""
        with self._counting:
            if len(self._served) >= MOST_CLIENTS:
                self._make_room()
            if len(self._served) < MOST_CLIENTS:
                self._served[request] = monotonic()
            elif len(self._turned_away) < MOST_TURNED_AWAY:
                self._turned_away.add(request)
            else:
                super().shutdown_request(request)
                return
        super().process_request(request, client_address)

    def finish_request(self, request: Any, client_address: Any) -> None:  # noqa: ANN401 - as there
        """Serve a connection, in its own thread."""
        handler = _TurnedAway if request in self._turned_away else _Served
        handler(request, client_address, self)

    def shutdown_request(self, request: Any) -> None:  # noqa: ANN401 - as there
        """End a connection."""
        with self._counting:
            self._served.pop(request, None)
            self._turned_away.discard(request)
        super().shutdown_request(request)

    def has_asked(self, connection: socket) -> None:
        """Keep a client's place, whoever else comes."""
        with self._counting:
            if connection in self._served:
                self._served[connection] = inf

    def end_connections(self) -> None:
        """End open connections; their threads notice it."""
        with self._counting:
            still_open = (*self._served, *self._turned_away)
        for connection in still_open:
            _end(connection)

    def _make_room(self) -> None:
        """End the connection that has been open longest without a request, if any."""
        oldest = min(self._served, key=self._served.__getitem__)
        if monotonic() - self._served[oldest] >= _BEFORE_ASKING_S:
            del self._served[oldest]
            _end(oldest)

    def handle_error(self, request: Any, client_address: Any) -> None:  # noqa: ANN401 - as there
        """Ignore a client that disconnects in the middle."""


def _end(connection: socket) -> None:
    """End a connection; its thread notices it."""
    with suppress(OSError):  # the connection has ended already
        connection.shutdown(SHUT_RDWR)


class _RequestBytes(io.RawIOBase):
    """The bytes of a connection, until its time-out.

    Args:
        connection: Where it comes.
        patience_s: How long one whole request may take, and the silence before it.
    """

    def __init__(self, connection: socket, patience_s: float) -> None:
        self._connection = connection
        self._patience_s = patience_s
        self.await_another()

    def await_another(self) -> None:
        """Restart the time-out."""
        self._until_s = monotonic() + self._patience_s

    def readable(self) -> bool:
        """Whether it can be read."""
        return True

    def readinto(self, buffer: Any) -> int:  # noqa: ANN401 - as there
        """Read what has come.

        Raises:
            TimeoutError: The patience has ended.
        """
        left_s = self._until_s - monotonic()
        if left_s <= 0:
            raise TimeoutError
        self._connection.settimeout(left_s)
        return self._connection.recv_into(buffer)


class _Served(BaseHTTPRequestHandler):
    """Reads one request after the other of a connection, and answers it."""

    server: HttpPort
    protocol_version = "HTTP/1.1"
    server_version = "robolink"
    sys_version = ""
    timeout = _SILENCE_S
    disable_nagle_algorithm = True

    def setup(self) -> None:
        """Apply the time-out to a whole request, not to each byte of it."""
        super().setup()
        self.rfile.close()
        self._coming = _RequestBytes(self.connection, self.timeout)
        self.rfile = io.BufferedReader(self._coming)

    def handle_one_request(self) -> None:
        """Read a request and answer it."""
        self._coming.await_another()
        super().handle_one_request()

    def do_GET(self) -> None:
        """Answer GET."""
        self._asked()

    def do_POST(self) -> None:
        """Answer POST."""
        self._asked()

    def _asked(self) -> None:
        body = self._body()
        if body is not None:
            self._answer(self.command, body)

    def _body(self) -> bytes | None:
        """Return the body of the request; ``None`` if it was refused because of it."""
        lengths = self.headers.get_all("Content-Length", ["0"])
        length = lengths[0]
        if (
            len(lengths) > 1
            or not (length.isascii() and length.isdigit())
            or "Transfer-Encoding" in self.headers
        ):
            self._refuse(
                HTTPStatus.LENGTH_REQUIRED,
                tr("The request says no Content-Length."),
                tr("Give one, a number of bytes, and no Transfer-Encoding."),
            )
        elif len(length) > 9 or int(length) > LONGEST_REQUEST:
            self._refuse(
                HTTPStatus.REQUEST_ENTITY_TOO_LARGE,
                tr("The request is too long."),
                tr("Send {most} bytes or fewer.", most=LONGEST_REQUEST),
            )
        elif len(body := self.rfile.read(int(length))) < int(length):
            # The client left in the middle of its request, so what it wanted is unknown.
            self._refuse(
                HTTPStatus.BAD_REQUEST, tr("The request ended early."), tr("Send it whole.")
            )
        else:
            return body
        return None

    def send_error(
        self,
        code: int,
        message: str | None = None,  # noqa: ARG002 - part of the signature
        explain: str | None = None,  # noqa: ARG002 - part of the signature
    ) -> None:
        """Answer a malformed request, or another method, in JSON like everything else."""
        self.request_version = self.protocol_version  # without it the answer has no headers
        if code == HTTPStatus.NOT_IMPLEMENTED:
            self.close_connection = True
            self._asked()
        else:
            self._refuse(HTTPStatus(code), *no_request(HTTPStatus(code)))

    def log_message(self, *_: object) -> None:
        """Print nothing: the URL holds the token."""

    def _refuse(self, status: HTTPStatus, what: str, remedy: str) -> None:
        self.close_connection = True  # the rest of the request is not read
        self._send(ApiReply(status, error_document(what, remedy)))

    def _answer(self, method: str, body: bytes) -> None:
        self.server.has_asked(self.connection)
        reply = self._of_a_page() or self.server.answered(method, self.path, body)
        if reply.status == HTTPStatus.FORBIDDEN:
            self.close_connection = True  # a client without the token keeps no place
        self._send(reply)

    def _of_a_page(self) -> ApiReply | None:
        """Return the answer to a browser that asks for a page of another origin."""
        if "Origin" in self.headers:
            return ApiReply(
                HTTPStatus.FORBIDDEN,
                error_document(
                    tr(
                        "This request comes from a web page (Origin), and web pages are not "
                        "answered."
                    ),
                    tr("Ask from a program of your own, without an Origin header."),
                ),
            )
        names = self.headers.get_all("Host", [])
        if len(names) > 1 or not (self.server.allow_remote or all(map(is_this_machine, names))):
            return ApiReply(
                HTTPStatus.FORBIDDEN,
                error_document(
                    tr("The Host of this request names another machine."),
                    tr("Use localhost, or the address of this machine."),
                ),
            )
        return None

    def _send(self, reply: ApiReply) -> None:
        data = json.dumps(reply.document).encode()
        self.connection.settimeout(self.timeout)  # for the whole answer
        self.send_response(reply.status)
        self.send_header("Content-Type", "application/json")
        self.send_header("Content-Length", str(len(data)))
        self.send_header("Cache-Control", "no-store")
        if reply.allow:
            self.send_header("Allow", ", ".join(reply.allow))
        if self.close_connection:
            self.send_header("Connection", "close")
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(data)


class _TurnedAway(_Served):
    """Answers the first request, whatever it is, that there is no room.

    A client reads no answer before it has asked; it would see its connection end, and not why.
    """

    timeout = _TURNED_AWAY_S

    def _answer(self, method: str, body: bytes) -> None:  # noqa: ARG002 - of those who are served
        self._refuse(
            HTTPStatus.SERVICE_UNAVAILABLE,
            tr("{most} clients are connected to this simulator already.", most=MOST_CLIENTS),
            tr("Let those end that are done, and try again."),
        )
