"""Pictures that a camera hands out over HTTP, one a request."""

import hashlib
import io
import socket
import ssl
from collections.abc import Iterator
from contextlib import contextmanager
from http.client import HTTPException, HTTPMessage, HTTPResponse, IncompleteRead
from typing import TYPE_CHECKING, Final, cast
from urllib.parse import urljoin

from robolink.errors import CalibrationError
from robolink.eye.cameras.address import CameraAddress
from robolink.eye.cameras.authorization import authorization
from robolink.eye.cameras.decoding import MOST_BYTES, decoded, unreadable
from robolink.eye.picture import CameraPicture
from robolink.messages import tr
from robolink.timing import NS_PER_S, Clock, Deadline, SystemClock

if TYPE_CHECKING:
    from _typeshed import WriteableBuffer

__all__ = ["HttpSource", "ReadLimit", "asked_for", "reading"]

_MOST_REDIRECTS: Final = 3
_REDIRECTS: Final = frozenset({301, 302, 303, 307, 308})
_REFUSED: Final = frozenset({401, 403, 407})
_BUSY: Final = frozenset({423, 429, 503})
"""Answers of a camera that others are using: Locked, Too Many Requests, Service Unavailable."""


class HttpSource:
    """Implements :class:`~robolink.eye.source.PictureSource` on an address of snapshots.

    Each picture is asked for on a connection of its own, so that no answer of an earlier question
    can be read. One deadline holds for the whole exchange. The server may still hand out a picture
    that it had: whoever uses the source has to look for that.

    Args:
        url: ``http://`` or ``https://``; user and password are sent as the camera asks for them.
        timeout_s: How long an exchange may take.
        clock: What is waited on.
    """

    def __init__(self, url: str, *, timeout_s: float = 5.0, clock: Clock | None = None) -> None:
        self._address = CameraAddress.of(url)
        self._timeout_s = timeout_s
        self._clock = clock or SystemClock()

    @property
    def identity(self) -> str:
        """The address, without user and password."""
        return self._address.shown

    @property
    def exposure_us(self) -> float | None:
        """Unknown: each maker has an address of its own for that."""
        return None

    def expose(self, exposure_us: float) -> None:
        """Do nothing: see :attr:`exposure_us`."""

    def take(self) -> CameraPicture:
        """Ask for a picture; see :class:`~robolink.eye.source.PictureSource`.

        Raises:
            CalibrationError: ``camera_gone``: nothing answers, or the line broke;
                ``camera_refused``: it answers with a refusal; ``camera_taken``: it is busy;
                ``picture_late``: the answer did not end in time; ``picture_unreadable``.
        """
        asked_ns = self._clock.now_ns()
        with asked_for(self._address, ReadLimit(self._clock, self._timeout_s)) as answer:
            data = answer.read(MOST_BYTES + 1)
            missing = answer.length  # what was announced and did not come
        if missing and len(data) <= MOST_BYTES:
            raise unreadable(self.identity, cause=tr("it ends in the middle"))
        if len(data) > MOST_BYTES:
            raise unreadable(
                self.identity, cause=tr("it is larger than {most} bytes", most=MOST_BYTES)
            )
        return CameraPicture(
            grey=decoded(data, self.identity),
            asked_s=asked_ns / NS_PER_S,
            digest=hashlib.sha256(data).hexdigest(),
            name=self.identity,
            encoded=data,
        )

    def close(self) -> None:
        """Nothing is open between two pictures."""


class ReadLimit:
    """How long reading may take.

    Args:
        clock: The clock of the deadline.
        limit_s: How long, from now, or from when it is renewed.
    """

    def __init__(self, clock: Clock, limit_s: float) -> None:
        self._clock, self.limit_s = clock, limit_s
        self._deadline = Deadline.after(clock, limit_s)

    def renew(self) -> None:
        """Let the time begin anew: for the next picture of a stream."""
        self._deadline = Deadline.after(self._clock, self.limit_s)

    @property
    def left_s(self) -> float:
        """Seconds left, more than none.

        Raises:
            TimeoutError: The time has passed.
        """
        left_s = self._deadline.remaining_s()
        if not left_s:
            raise TimeoutError("the time has passed")
        return left_s


@contextmanager
def asked_for(address: CameraAddress, limit: ReadLimit) -> Iterator[HTTPResponse]:
    """Ask for an address, and yield its answer where that is 200; follows within one host.

    Args:
        address: What is asked for.
        limit: How long it may take; errors of reading in the block are converted as well.

    Raises:
        CalibrationError: As :meth:`HttpSource.take`.
    """
    with reading(address.shown, limit), _answered(address, limit) as answer:
        yield answer


@contextmanager
def reading(shown: str, limit: ReadLimit) -> Iterator[None]:
    """Convert the errors of reading from a camera.

    Args:
        shown: Which camera.
        limit: How long it may take.

    Raises:
        CalibrationError: As :meth:`HttpSource.take`.
    """
    try:
        yield
    except IncompleteRead as error:
        raise unreadable(shown, cause=tr("it ends in the middle")) from error
    except TimeoutError as error:
        raise CalibrationError(
            "picture_late",
            tr(
                "{camera} delivered no picture within {limit:g} s.",
                camera=shown,
                limit=limit.limit_s,
            ),
            remedy=tr("Check network and camera; a smaller picture is faster."),
        ) from error
    except ssl.SSLCertVerificationError as error:
        raise CalibrationError(
            "camera_refused",
            tr(
                "The certificate of {camera} is not valid: {cause}.",
                camera=shown,
                cause=error.verify_message,
            ),
            remedy=tr("Install the certificate of the camera's maker, or use http:// instead."),
        ) from error
    except HTTPException as error:
        if not isinstance(error, OSError):
            raise unreadable(shown, cause=tr("it does not answer in HTTP")) from error
        raise _gone(shown, error) from error
    except OSError as error:
        raise _gone(shown, error) from error


def _gone(shown: str, error: OSError) -> CalibrationError:
    return CalibrationError(
        "camera_gone",
        tr("{camera} does not answer: {cause}.", camera=shown, cause=error.strerror or error),
        remedy=tr("Check power, cable and address of the camera."),
    )


@contextmanager
def _answered(address: CameraAddress, limit: ReadLimit) -> Iterator[HTTPResponse]:
    here, sent = address, ""
    for _ in range(_MOST_REDIRECTS + 2):  # one of them may be for a login
        with _connected(here, limit) as connection:
            connection.sendall(_request(here, sent))
            readable = cast(socket.socket, _Readable(connection, limit))
            answer = HTTPResponse(readable, method="GET")
            with answer:
                answer.begin()
                if answer.status == 200:
                    yield answer
                    return
                if answer.status == 401 and address.user and not sent:
                    sent = authorization(here, answer.headers)
                    if sent:
                        continue
                here = _led_to(here, answer.status, answer.headers)
                sent = ""
    raise _refused(address.shown, tr("it redirects in a circle"))


def _request(address: CameraAddress, authorized: str) -> bytes:
    host = f"[{address.host}]" if ":" in address.host else address.host
    lines = [
        f"GET {address.target} HTTP/1.1",
        f"Host: {host}:{address.port}",
        "User-Agent: robolink",
        "Accept: image/*, */*;q=0.1",
        "Accept-Encoding: identity",
        "Cache-Control: no-cache, no-store",
        "Pragma: no-cache",
        "Connection: close",
    ]
    if authorized:
        lines.append(f"Authorization: {authorized}")
    return ("\r\n".join(lines) + "\r\n\r\n").encode("ascii", "replace")


def _led_to(here: CameraAddress, status: int, headers: HTTPMessage) -> CameraAddress:
    """Return where a redirect leads; a refusal for every other answer.

    Raises:
        CalibrationError: ``camera_refused`` or ``camera_taken``.
    """
    if status in _REDIRECTS:
        scheme = "https" if here.secure else "http"
        base = f"{scheme}://{here.host}:{here.port}{here.target}"
        there = here.within(urljoin(base, headers.get("Location", "")))
        if there is None:
            raise _refused(here.shown, tr("it redirects to another host"))
        return there
    if status in _BUSY:
        raise CalibrationError(
            "camera_taken",
            tr("{camera} is busy: it answers {status}.", camera=here.shown, status=status),
            remedy=tr("Close the other programs and browsers that use this camera."),
        )
    if status in _REFUSED:
        raise _refused(here.shown, tr("it asks for a user and a password (HTTP {n})", n=status))
    raise _refused(here.shown, tr("it answers HTTP {n}", n=status))


def _refused(shown: str, cause: str) -> CalibrationError:
    return CalibrationError(
        "camera_refused",
        tr("{camera} gives no picture: {cause}.", camera=shown, cause=cause),
        remedy=tr("Correct the camera's address, user and password; try them in a browser."),
    )


@contextmanager
def _connected(address: CameraAddress, limit: ReadLimit) -> Iterator[socket.socket]:
    connection = socket.create_connection((address.host, address.port), timeout=limit.left_s)
    try:
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        if address.secure:
            connection.settimeout(limit.left_s)
            secured = ssl.create_default_context().wrap_socket(
                connection, server_hostname=address.host
            )
            connection = secured
        yield connection
    finally:
        connection.close()


class _Readable:
    """What HTTPResponse needs of a socket, under one deadline for all reads."""

    def __init__(self, connection: socket.socket, limit: ReadLimit) -> None:
        self._raw = _LimitedReader(connection, limit)

    def makefile(self, mode: str) -> io.BufferedReader:  # noqa: ARG002 - it is always "rb"
        return io.BufferedReader(self._raw)


class _LimitedReader(io.RawIOBase):
    def __init__(self, connection: socket.socket, limit: ReadLimit) -> None:
        self._connection, self._limit = connection, limit

    def readable(self) -> bool:
        return True

    def readinto(self, buffer: "WriteableBuffer") -> int:
        self._connection.settimeout(self._limit.left_s)
        return self._connection.recv_into(buffer)
