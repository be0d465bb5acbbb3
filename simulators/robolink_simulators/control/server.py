"""The control API: HTTP and JSON, for a client in any language (docs/control-api.md).

The base URL is ``http://127.0.0.1:PORT/TOKEN/v1``. Below it stand ``openapi.json`` and, of each
simulated controller, ``cells/NAME``: what it is and which acts it has; ``cells/NAME/ACT`` is done
by POST, with what it takes as a JSON object. What changes nothing may be asked by GET, too.

Who does not show the token learns nothing, not even which paths there are, and a web page in a
browser does not know it. At most :data:`MOST_CLIENTS` are connected at a time, each request is
at most :data:`LONGEST_REQUEST` bytes, and a connection that is silent ends by itself.
"""

import json
import os
import threading
from collections.abc import Mapping
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib import metadata
from importlib.resources import files
from socket import AF_INET, AF_INET6, SHUT_RDWR, SO_REUSEADDR, SOL_SOCKET, socket
from typing import Any, Final
from urllib.parse import parse_qsl, urlsplit

from robolink.closing import ClosedAtExit
from robolink.errors import ConfigError, ConnectError, RobolinkError
from robolink.messages import tr
from robolink_simulators.control.acts.registry import ACTS, UnknownActError, act_named, perform
from robolink_simulators.control.cell import ControlledCell
from robolink_simulators.control.tokens import drawn_token, is_token
from robolink_simulators.epson.refusals import SpelRefusal
from robolink_simulators.hosting.loopback import require_loopback
from robolink_simulators.not_now import NotNowError
from robolink_simulators.softmotion.smc_errors import BlockRefused

VERSION: Final = "v1"
SCHEMA: Final = "robolink/control/1"
MOST_CLIENTS: Final = 64
LONGEST_REQUEST: Final = 65_536
_SILENCE_S: Final = 60.0
_MOST_ASKED: Final = 50

_Reply = tuple[HTTPStatus, dict[str, Any]]


class ControlServer(ClosedAtExit):
    """Serves the control API of one or many simulated controllers until it is closed.

    Args:
        cells: The controllers, by name.
        address: Host and port to bind to; port 0 takes a free one.
        allow_remote: Whether an address that other machines can reach is taken.
        token: What its URL holds; drawn when it is left out.

    Attributes:
        cells: The controllers, by name.
        requests: How many were answered.

    Raises:
        ConfigError: The address is not loopback and ``allow_remote`` is off.
        ConnectError: The port is taken, or the address is not this machine's.
    """

    def __init__(
        self,
        cells: Mapping[str, ControlledCell],
        address: tuple[str, int] = ("127.0.0.1", 0),
        *,
        allow_remote: bool = False,
        token: str | None = None,
    ) -> None:
        require_loopback(address[0], allow_remote=allow_remote)
        self.cells = dict(cells)
        self.requests = 0
        self._token = drawn_token() if token is None else token
        self._host = address[0]
        try:
            self._http = _HttpServer(address, self)
        except (OSError, OverflowError) as error:
            raise ConnectError(
                tr(
                    "The simulator cannot listen on {host} port {port}: {cause}.",
                    host=address[0],
                    port=address[1],
                    cause=getattr(error, "strerror", None) or error,
                ),
                remedy=tr("Use another port; 0 takes a free one."),
            ) from error
        self._closed = False
        self._thread = threading.Thread(
            target=self._http.serve_forever, args=(0.2,), name="control", daemon=True
        )
        self._thread.start()

    @property
    def url(self) -> str:
        """The base URL, with the token; it ends in the version of the API."""
        host = f"[{self._host}]" if ":" in self._host else self._host
        return f"http://{host}:{self._http.server_address[1]}/{self._token}/{VERSION}"

    def url_of(self, name: str) -> str:
        """Return where the acts of a controller stand."""
        return f"{self.url}/cells/{name}"

    def close(self) -> None:
        """Stop serving, and end every connection. Idempotent."""
        if not self._closed:
            self._closed = True
            self._http.shutdown()
            self._http.end_connections()
            self._http.server_close()
            self._thread.join()

    def answered(self, method: str, target: str, body: bytes) -> _Reply:
        """Return what a request is answered with."""
        self.requests += 1
        try:
            parts = urlsplit(target)
        except ValueError:  # half an address of IPv6
            return HTTPStatus.BAD_REQUEST, _error(_no_request(HTTPStatus.BAD_REQUEST))
        token, *path = parts.path.strip("/").split("/")
        if not is_token(token, self._token):
            return HTTPStatus.FORBIDDEN, _error(
                tr("That is not the token of this simulator."),
                tr("Take the whole URL that 'robolink sim' prints; each start has its own."),
            )
        try:
            return self._found(method, path, _given(method, parts.query, body))
        except UnknownActError as error:
            return HTTPStatus.NOT_FOUND, _error(error.what, error.remedy)
        except NotNowError as error:
            return HTTPStatus.CONFLICT, _error(error.what, error.remedy)
        except RobolinkError as error:
            return HTTPStatus.BAD_REQUEST, _error(error.what, error.remedy)
        except (SpelRefusal, BlockRefused) as refused:
            return HTTPStatus.CONFLICT, _error(str(refused))
        except Exception as error:
            # Whoever asked is told, else its client waits for an answer that never comes.
            return HTTPStatus.INTERNAL_SERVER_ERROR, _error(
                tr("The simulator failed: {cause}.", cause=f"{type(error).__name__}: {error}")
            )

    def _found(self, method: str, path: list[str], given: dict[str, Any]) -> _Reply:
        match path:
            case [version, "openapi.json"] if version == VERSION:
                _require_nothing(given)
                return HTTPStatus.OK, json.loads(
                    files("robolink_simulators.control").joinpath("openapi.json").read_bytes()
                )
            case [version] if version == VERSION:
                _require_nothing(given)
                return HTTPStatus.OK, _ok({"cells": {it: self._about(it) for it in self.cells}})
            case [version, "cells", name] if version == VERSION and name in self.cells:
                _require_nothing(given)
                return HTTPStatus.OK, _ok(self._about(name))
            case [version, "cells", name, act] if version == VERSION and name in self.cells:
                return self._acted(method, self.cells[name], act, given)
            case _:
                return HTTPStatus.NOT_FOUND, _error(
                    tr("There is no such address."),
                    tr(
                        "These are known: {known}.", known=", ".join(map(self._path_of, self.cells))
                    ),
                )

    def _acted(self, method: str, cell: ControlledCell, act: str, given: dict[str, Any]) -> _Reply:
        if method == "GET" and not act_named(cell, act).reads:
            return HTTPStatus.METHOD_NOT_ALLOWED, _error(
                tr("{act} changes something: send it by POST.", act=act)
            )
        return HTTPStatus.OK, _ok(perform(cell, act, given))

    def _about(self, name: str) -> dict[str, Any]:
        cell = self.cells[name]
        return {
            "kind": cell.simulator.kind,
            "machine": cell.simulator.machine_name,
            "seed": cell.simulator.seed,
            "urls": dict(cell.urls),
            "acts": sorted(ACTS[cell.simulator.kind]),
            "version": metadata.version("robolink"),
        }

    def _path_of(self, name: str) -> str:
        return f"{VERSION}/cells/{name}/ACT"


def _given(method: str, query: str, body: bytes) -> dict[str, Any]:
    """Return what an act is given: a JSON object, or numbers and texts behind the question mark.

    Raises:
        ConfigError: It is neither, or stands where it would not be looked for.
    """
    if method == "GET":
        try:
            asked = parse_qsl(query, keep_blank_values=True, max_num_fields=_MOST_ASKED)
        except ValueError as error:
            raise ConfigError(
                tr("The request asks for too much."),
                remedy=tr("Give {most} values or fewer.", most=_MOST_ASKED),
            ) from error
        return _each_once([(name, _value(text)) for name, text in asked])
    if query:
        raise ConfigError(
            tr("A POST has its values in its body, not behind the question mark."),
            remedy=tr("Give them there as a JSON object."),
        )
    try:
        given = json.loads(body, object_pairs_hook=_each_once) if body.strip() else {}
    except ConfigError:  # which is a ValueError too
        raise
    except (ValueError, RecursionError):
        given = None
    if not isinstance(given, dict):
        raise ConfigError(
            tr("The request is not a JSON object."),
            remedy=tr("Give it as {example}.", example="{}"),
        )
    return given


def _require_nothing(given: dict[str, Any]) -> None:
    for name in given:
        raise ConfigError(
            tr("Nothing is known here by the name {name!r}.", name=name[:80]),
            remedy=tr("Only an act takes values."),
        )


def _each_once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Return what was given by name.

    Raises:
        ConfigError: A name stands there twice, and one of its values would be lost.
    """
    given = dict(pairs)
    if len(given) < len(pairs):
        names = [name for name, _ in pairs]
        twice = next(name for name in names if names.count(name) > 1)
        raise ConfigError(
            tr("{name!r} is given twice.", name=twice[:80]), remedy=tr("Give it once.")
        )
    return given


def _value(text: str) -> object:
    try:
        value = json.loads(text)
    except (ValueError, RecursionError):
        return text
    return text if isinstance(value, (dict, list)) else value


def _ok(answer: Mapping[str, Any]) -> dict[str, Any]:
    return {**answer, "schema": SCHEMA, "ok": True}


def _error(what: str, remedy: str = "") -> dict[str, Any]:
    return {"schema": SCHEMA, "ok": False, "error": what, "remedy": remedy}


def _no_request(status: HTTPStatus) -> str:
    return tr("What came is no request that is answered here: {cause}.", cause=status.phrase)


class _HttpServer(ThreadingHTTPServer):
    """Serves each connection in a thread of its own, a bounded number of them."""

    daemon_threads = True
    block_on_close = False
    request_queue_size = 64

    def __init__(self, address: tuple[str, int], control: ControlServer) -> None:
        self.address_family = AF_INET6 if ":" in address[0] else AF_INET
        self.control = control
        self._open: set[socket] = set()
        self._counting = threading.Lock()
        super().__init__(address, _Handler)

    def server_bind(self) -> None:
        """Bind without asking who this machine is, which may take seconds."""
        if os.name == "posix":
            # Else nobody can listen here for a minute after one who was connected at the end. On
            # Windows it would let two programs share the port.
            self.socket.setsockopt(SOL_SOCKET, SO_REUSEADDR, 1)
        self.socket.bind(self.server_address)
        self.server_address = self.socket.getsockname()

    def process_request(self, request: Any, client_address: Any) -> None:  # noqa: ANN401 - as there
        """Serve a connection, unless there are too many."""
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
        """End those that are open; their threads see it."""
        with self._counting:
            still_open = tuple(self._open)
        for connection in still_open:
            try:
                connection.shutdown(SHUT_RDWR)
            except OSError:
                continue  # it has ended by itself

    def handle_error(self, request: Any, client_address: Any) -> None:  # noqa: ANN401 - as there
        """A client that is gone in the middle is nobody's business."""


class _Handler(BaseHTTPRequestHandler):
    """Reads one request after the other of a connection, and answers it."""

    server: _HttpServer
    protocol_version = "HTTP/1.1"
    server_version = "robolink"
    sys_version = ""
    timeout = _SILENCE_S
    disable_nagle_algorithm = True

    def do_GET(self) -> None:
        """Look."""
        body = self._body()
        if body:
            self._refuse(
                HTTPStatus.BAD_REQUEST,
                tr("A GET has its values behind the question mark, not in a body."),
            )
        elif body is not None:
            self._answer("GET", b"")

    def do_POST(self) -> None:
        """Act."""
        body = self._body()
        if body is not None:
            self._answer("POST", body)

    def _body(self) -> bytes | None:
        """Return what came with the request; ``None`` where it was refused for that."""
        lengths = self.headers.get_all("Content-Length", ["0"])
        length = lengths[0]
        if (
            len(lengths) > 1
            or not (length.isascii() and length.isdigit())
            or "Transfer-Encoding" in self.headers
        ):
            self._refuse(HTTPStatus.LENGTH_REQUIRED, tr("The request says no Content-Length."))
        elif len(length) > 9 or int(length) > LONGEST_REQUEST:
            self._refuse(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, tr("The request is too long."))
        elif len(body := self.rfile.read(int(length))) < int(length):
            # Its sender is gone in the middle: what it wanted done, nobody knows.
            self._refuse(HTTPStatus.BAD_REQUEST, tr("The request ended early."))
        else:
            return body
        return None

    def send_error(
        self,
        code: int,
        message: str | None = None,  # noqa: ARG002 - part of the signature
        explain: str | None = None,  # noqa: ARG002 - part of the signature
    ) -> None:
        """Answer what is no request, or one of another method, in JSON as everything else."""
        self.request_version = self.protocol_version  # or it would get no head
        if code == HTTPStatus.NOT_IMPLEMENTED:
            code = HTTPStatus.METHOD_NOT_ALLOWED
        self._refuse(HTTPStatus(code), _no_request(HTTPStatus(code)))

    def log_message(self, *_: object) -> None:
        """Print nothing: the URL holds the token."""

    def _refuse(self, status: HTTPStatus, what: str) -> None:
        self.close_connection = True  # what follows is not read
        self._send(status, _error(what))

    def _answer(self, method: str, body: bytes) -> None:
        self._send(*self.server.control.answered(method, self.path, body))

    def _send(self, status: HTTPStatus, document: dict[str, Any]) -> None:
        data = json.dumps(document).encode()
        self.send_response(status)
        self.send_header("Content-Type", "application/json")
        self.send_header("Content-Length", str(len(data)))
        self.send_header("Cache-Control", "no-store")
        if status == HTTPStatus.METHOD_NOT_ALLOWED:
            self.send_header("Allow", "GET, POST")
        if self.close_connection:
            self.send_header("Connection", "close")
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(data)
