"""The control API: HTTP and JSON, for a client in any language (docs/control-api.md).

The base URL is ``http://127.0.0.1:PORT/TOKEN/v1``. Below it stand ``openapi.json`` and, of each
simulated controller, ``cells/NAME``: what it is and which acts it has; ``cells/NAME/ACT`` is done
by POST, with what it takes as a JSON object. What changes nothing may be asked by GET, too.

Who does not show the token learns nothing, not even which paths there are, and a web page in a
browser does not know it. How many may be connected, and how long a request may be, stands in
:mod:`robolink_simulators.control.http_port`.
"""

import json
import threading
from collections.abc import Callable, Mapping
from http import HTTPStatus
from importlib import metadata
from importlib.resources import files
from typing import Any, Final
from urllib.parse import parse_qsl, urlsplit

from robolink.errors import ConfigError, RobolinkError
from robolink.interrupts import ClosedAtExit
from robolink.messages import known_names, tr
from robolink_simulators.control.acts import (
    ACTS,
    MACHINE_REFUSALS,
    UnknownActError,
    defect,
    machine_refusal,
    methods_of,
    perform,
)
from robolink_simulators.control.cell import ControlledCell, drawn_token, is_token
from robolink_simulators.control.http_port import (
    SCHEMA,
    ApiReply,
    HttpPort,
    error_document,
    no_request,
)
from robolink_simulators.hosting.addresses import cannot_listen
from robolink_simulators.not_now import NotNowError

VERSION: Final = "v1"
_MOST_ASKED: Final = 50
_LOOKED_AT: Final = ("GET",)

_Address = tuple[tuple[str, ...], Callable[[dict[str, Any]], dict[str, Any]]]
"""The allowed HTTP methods of an address, and the function that returns its answer."""


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
        self.cells = dict(cells)
        self.requests = 0
        self._token = drawn_token() if token is None else token
        self._host = address[0]
        try:
            self._http = HttpPort(address, self.answered, allow_remote=allow_remote)
        except (OSError, OverflowError) as error:
            raise cannot_listen(*address, error) from error
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
        """Return the URL of a controller's acts."""
        return f"{self.url}/cells/{name}"

    def close(self) -> None:
        """Stop serving, and end every connection. Idempotent."""
        if not self._closed:
            self._closed = True
            self._http.shutdown()
            self._http.end_connections()
            self._http.server_close()
            self._thread.join()

    def answered(self, method: str, target: str, body: bytes) -> ApiReply:
        """Return the answer to a request."""
        self.requests += 1
        try:
            parts = urlsplit(target)
        except ValueError:  # an incomplete IPv6 address
            return _refused(HTTPStatus.BAD_REQUEST, *no_request(HTTPStatus.BAD_REQUEST))
        token, *path = parts.path.strip("/").split("/")
        if not is_token(token, self._token):
            return _refused(
                HTTPStatus.FORBIDDEN,
                tr("That is not the token of this simulator."),
                tr("Take the whole URL that 'robolink sim' prints; each start has its own."),
            )
        try:
            methods, answer = self._found(path)
            if method not in methods:
                return _not_allowed(method, methods)
            return ApiReply(HTTPStatus.OK, answer(_given(method, parts.query, body)))
        except UnknownActError as error:
            return _refused(HTTPStatus.NOT_FOUND, error.what, error.remedy)
        except NotNowError as error:
            return _refused(HTTPStatus.CONFLICT, error.what, error.remedy)
        except RobolinkError as error:
            return _refused(HTTPStatus.BAD_REQUEST, error.what, error.remedy)
        except MACHINE_REFUSALS as refused:
            return _refused(HTTPStatus.CONFLICT, *machine_refusal(refused))
        except Exception as error:
            # The error is answered: the client would otherwise wait for an answer that never comes.
            return _refused(HTTPStatus.INTERNAL_SERVER_ERROR, *defect(error))

    def _found(self, path: list[str]) -> _Address:
        """Return what an address offers: its methods, and their handlers.

        Raises:
            UnknownActError: Nothing is there.
        """
        match path:
            case [version, "openapi.json"] if version == VERSION:
                return _LOOKED_AT, _only(_described)
            case [version] if version == VERSION:
                return _LOOKED_AT, _only(
                    lambda: _ok({"cells": {it: self._about(it) for it in self.cells}})
                )
            case [version, "cells", name] if version == VERSION and name in self.cells:
                return _LOOKED_AT, _only(lambda: _ok(self._about(name)))
            case [version, "cells", name, act] if version == VERSION and name in self.cells:
                cell = self.cells[name]
                return methods_of(cell, act), lambda given: _ok(perform(cell, act, given))
            case _:
                raise UnknownActError(
                    tr("There is no such address."),
                    remedy=known_names(map(self._path_of, self.cells)),
                )

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
    """Return the values for an act: a JSON object, or numbers and texts behind the question mark.

    Raises:
        ConfigError: It is neither, or stands where it would not be looked for.
    """
    if method == "GET":
        if body:
            raise ConfigError(
                tr("A GET has its values behind the question mark, not in a body."),
                remedy=tr("Give them there, or send it by POST."),
            )
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
        given = json.loads(body, object_pairs_hook=_each_once) if body else {}
    except ConfigError:  # also a ValueError
        raise
    except (ValueError, RecursionError):
        given = None
    if not isinstance(given, dict):
        raise ConfigError(
            tr("The request is not a JSON object."),
            remedy=tr("Give it as {example}.", example="{}"),
        )
    return given


def _only(answer: Callable[[], dict[str, Any]]) -> Callable[[dict[str, Any]], dict[str, Any]]:
    """Return the handler of an address that takes no values."""

    def answered(given: dict[str, Any]) -> dict[str, Any]:
        for name in given:
            raise ConfigError(
                tr("Nothing is known here by the name {name!r}.", name=name[:80]),
                remedy=tr("Only an act takes values."),
            )
        return answer()

    return answered


def _described() -> dict[str, Any]:
    page = files("robolink_simulators.control").joinpath("openapi.json").read_bytes()
    described: dict[str, Any] = json.loads(page)
    return described


def _refused(status: HTTPStatus, what: str, remedy: str) -> ApiReply:
    return ApiReply(status, error_document(what, remedy))


def _not_allowed(method: str, methods: tuple[str, ...]) -> ApiReply:
    what = tr("{method} is not answered at this address.", method=method[:80])
    remedy = tr("Send it by {methods}.", methods=", ".join(methods))
    return ApiReply(HTTPStatus.METHOD_NOT_ALLOWED, error_document(what, remedy), methods)


def _each_once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Return the given values by name.

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
