"""The control API from Python, as ``robolink sim ctl`` and tests of one's own use it."""

import json
from http.client import HTTPConnection, HTTPException
from typing import Any, Final
from urllib.parse import urlsplit

from robolink.closing import ClosedAtExit
from robolink.errors import ConfigError, ConnectError, TransportBrokenError
from robolink.messages import tr

_LONGEST_ANSWER: Final = 1 << 23
_OK: Final = 200


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
        self._connection = HTTPConnection(host, port, timeout=timeout_s)

    def do(self, act: str, **given: object) -> dict[str, Any]:
        """Have something done, and return what it gives.

        Raises:
            ConfigError: The simulator cannot do it, and says why.
            ConnectError: Nobody listens there.
            TransportBrokenError: The simulator is gone.
        """
        return self._asked("POST", f"/{act}", given)

    def about(self) -> dict[str, Any]:
        """Return what the simulator is, its URLs and its acts; raises as :meth:`do`."""
        return self._asked("GET", "", {})

    def close(self) -> None:
        """Close the connection."""
        self._connection.close()

    def _asked(self, method: str, path: str, given: dict[str, object]) -> dict[str, Any]:
        if self._connection.sock is None:
            self._connect()
        try:
            body = json.dumps(given) if method == "POST" else None
            self._connection.request(method, self._path + path, body)
            reply = self._connection.getresponse()
            answer = json.loads(reply.read(_LONGEST_ANSWER))
        except (OSError, HTTPException, ValueError, RecursionError) as error:
            self.close()
            raise TransportBrokenError(
                tr("The simulator at {url} is gone.", url=self._shown),
                remedy=tr("Start it again."),
            ) from error
        if reply.status != _OK or not isinstance(answer, dict):
            told = answer if isinstance(answer, dict) else {}
            raise ConfigError(str(told.get("error", "")), remedy=str(told.get("remedy", "")))
        return {name: value for name, value in answer.items() if name not in ("ok", "schema")}

    def _connect(self) -> None:
        try:
            self._connection.connect()
        except OSError as error:
            raise ConnectError(
                tr("No simulator listens on {url}.", url=self._shown),
                remedy=tr("Start one with 'robolink sim epson' or 'robolink sim softmotion'."),
            ) from error
