"""The control API from Python, as ``robolink sim ctl`` and users' tests call it."""

import json
from collections.abc import Mapping
from http import HTTPStatus
from http.client import HTTPConnection, HTTPException, IncompleteRead
from socket import MSG_PEEK, socket
from typing import Any, Final
from urllib.parse import urlsplit

from robolink.errors import ConfigError, ConnectError, RemoteProtocolError, RobolinkError
from robolink.interrupts import ClosedAtExit
from robolink.messages import tr
from robolink_simulators.client_errors import (
    ended_unanswered,
    is_gone,
    is_no_simulator,
    is_silent,
    nobody_listens,
)
from robolink_simulators.control.http_port import SCHEMA

_LONGEST_ANSWER: Final = 1 << 23
"""Longest answer in bytes that is read when it states no length, as from some proxies."""

_REFUSED_BY: Final[Mapping[int, type[RobolinkError]]] = {
    HTTPStatus.INTERNAL_SERVER_ERROR: RemoteProtocolError,
    HTTPStatus.SERVICE_UNAVAILABLE: ConnectError,
}
"""Errors by HTTP status for refusals that the caller did not cause."""


class ControlClient(ClosedAtExit):
    """Acts at one simulated controller.

    Args:
        url: As ``robolink sim`` prints it: ``http://127.0.0.1:PORT/TOKEN/v1/cells/NAME``.
        timeout_s: Longest wait for an answer.

    Raises:
        ConfigError: It is not such a URL. It is not repeated, since it may hold a token.
    """

    def __init__(self, url: str, *, timeout_s: float = 10.0) -> None:
        try:
            parts = urlsplit(url)
            host, port = parts.hostname, parts.port
        except ValueError:
            host = port = None
        steps = parts.path.strip("/").split("/") if host else []
        if parts.scheme != "http" or not host or not port or "cells" not in steps:
            raise ConfigError(
                tr("This is not the control URL of a simulator."),
                remedy=tr("Take the one that 'robolink sim' prints."),
            )
        self._path = f"/{'/'.join(steps)}"
        self._shown = f"http://{host}:{port}"
        self._timeout_s = timeout_s
        self._connection = HTTPConnection(host, port, timeout=timeout_s)

    def do(self, act: str, **given: object) -> dict[str, Any]:
        """Carry out an act, and return its result.

        Raises:
            ConfigError: The simulator cannot do it, and says why.
            ConnectError: Nobody listens there, or too many clients are connected.
            TransportBrokenError: The simulator is gone.
            TransportTimeoutError: No answer came in time; whether it was done is not known.
            RemoteProtocolError: What answers is no simulator, or has a defect.
        """
        return self._asked("POST", f"/{act}", given)

    def about(self) -> dict[str, Any]:
        """Return what the simulator is, its URLs and its acts; raises as :meth:`do`."""
        return self._asked("GET", "", {})

    def close(self) -> None:
        """Close the connection."""
        self._connection.close()

    def _asked(self, method: str, path: str, given: dict[str, object]) -> dict[str, Any]:
        self._be_connected()
        body = json.dumps(given) if method == "POST" else None
        try:
            self._connection.request(method, self._path + path, body)
            with self._connection.getresponse() as reply:
                read = reply.read(None if reply.length else _LONGEST_ANSWER)
        except TimeoutError as error:
            self.close()
            raise is_silent(self._shown, self._timeout_s) from error
        except (OSError, IncompleteRead) as error:
            self.close()
            raise ended_unanswered(self._shown) from error
        except HTTPException as error:
            self.close()
            raise is_no_simulator(self._shown) from error
        if not read:
            self.close()
            raise ended_unanswered(self._shown)
        return self._told(reply.status, read)

    def _told(self, status: int, read: bytes) -> dict[str, Any]:
        """Return the answer, or raise the refusal."""
        try:
            answer = json.loads(read)
        except (ValueError, RecursionError):
            answer = None
        if not isinstance(answer, dict) or answer.get("schema") != SCHEMA:
            self.close()
            raise is_no_simulator(self._shown)
        if status != HTTPStatus.OK:
            kind = _REFUSED_BY.get(status, ConfigError)
            raise kind(str(answer.get("error")), remedy=str(answer.get("remedy")))
        return {name: value for name, value in answer.items() if name not in ("ok", "schema")}

    def _be_connected(self) -> None:
        """Connect, unless connected; reconnect if the simulator has ended a silent connection."""
        held = self._connection.sock
        if held is not None and not _has_ended(held):
            return
        self.close()
        try:
            self._connection.connect()
        except OSError as error:
            raise (nobody_listens if held is None else is_gone)(self._shown) from error


def _has_ended(connection: socket) -> bool:
    """Return whether the far side ended a connection, or sent data without a request.

    Looked at before each request: one that was sent into an ended connection may, for all that
    its sender knows, have been carried out.
    """
    waits_s = connection.gettimeout()
    connection.setblocking(False)
    try:
        connection.recv(1, MSG_PEEK)
    except BlockingIOError:
        return False
    except OSError:
        return True
    finally:
        connection.settimeout(waits_s)
    return True
