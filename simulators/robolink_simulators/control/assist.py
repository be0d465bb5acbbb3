"""The assist port: the hands, eyes and truth of a served simulator, as JSON lines.

The first line shows the token of the URL, ``{"token": "..."}``; each further one has something
done: ``{"do": "look"}``. Both are answered with ``{"ok": true, ...}``, what cannot be done with
``{"ok": false, "error": sentence, "remedy": what to do next}``. A wrong token
ends the connection after its answer; a line that is no JSON object, or is longer than
:data:`LONGEST_LINE` bytes, at once, so that a web page which posts to the port gets nothing
done. At most :data:`MOST_CLIENTS` are connected: a newcomer
takes the place of whoever has waited longest without showing the token, and where all have shown
it, there is none for him. So nobody who connects and keeps silent keeps others out.
"""

import json
import socket
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Final
from urllib.parse import urlsplit

from robolink.errors import ConfigError, RobolinkError
from robolink.interrupts import ClosedAtExit
from robolink.messages import known_names, tr
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.cell.habits import PersonManner
from robolink_simulators.cell.person import PersonLook
from robolink_simulators.cell.places import Axis, XyzMm
from robolink_simulators.client_errors import (
    ended_unanswered,
    is_no_simulator,
    is_silent,
    nobody_listens,
)
from robolink_simulators.control.acts import MACHINE_REFUSALS, defect, machine_refusal
from robolink_simulators.control.acts import perform as perform_act
from robolink_simulators.control.cell import AnySimulator, ControlledCell, drawn_token, is_token
from robolink_simulators.control.declared_acts import Answer, Given
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.in_process import epson as in_process
from robolink_simulators.hosting.in_process import softmotion as plc_in_process
from robolink_simulators.hosting.streams.tcp_host import TcpHost
from robolink_simulators.softmotion.mailbox.simulator import SoftMotionSimulator


def perform(simulator: AnySimulator | ControlledCell, request: Given) -> Answer:
    """Carry out the act in ``request["do"]`` and return its result.

    Raises:
        ConfigError: There is no such act, or a value is missing, wrong or unknown.
        SpelRefusal, BlockRefused: The simulated robot cannot do it.
    """
    cell = simulator if isinstance(simulator, ControlledCell) else ControlledCell(simulator)
    given = {name: value for name, value in request.items() if name != "do"}
    return perform_act(cell, request.get("do"), given)


SCHEME: Final = "assist+tcp"

_TOKEN_CHARACTERS: Final = frozenset(
    "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_"
)


@dataclass(frozen=True, slots=True)
class AssistAddress:
    """The parts of an assist URL.

    Attributes:
        host: Host name or address.
        port: TCP port.
        token: What is shown at the entrance; empty when the URL has none. Never printed.
    """

    host: str
    port: int
    token: str

    @property
    def shown(self) -> str:
        """The URL without its token, for sentences and records."""
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"{SCHEME}://{host}:{self.port}"

    def __repr__(self) -> str:
        return f"AssistAddress({self.shown!r})"


def assist_address(url: str) -> AssistAddress:
    """Split an assist URL into its parts.

    Args:
        url: ``assist+tcp://TOKEN@127.0.0.1:PORT``.

    Raises:
        ConfigError: It is not an assist URL. It is not repeated, since it may hold a token.
    """
    try:
        parts = urlsplit(url)
        host, port, token = parts.hostname, parts.port, parts.username or ""
    except ValueError:
        host = None
    if (
        not host
        or not port
        or parts.scheme != SCHEME
        or parts.password is not None
        or not set(token) <= _TOKEN_CHARACTERS
    ):
        raise ConfigError(
            tr("This is not an assist URL."),
            remedy=tr("Take the one that 'robolink sim' prints."),
        )
    return AssistAddress(host, port, token)


LEAST_THINKING_S: Final = 0.35
"""Shortest real time, in seconds, in which a person with a thinking time answers, however fast
simulated time passes. A driver would ignore an earlier answer as typed before the question.
"""

LONGEST_LINE: Final = 4096
"""Longest request in bytes. The longest one in use, which sets up a whole world, takes about 1500.
"""

MOST_CLIENTS: Final = 16

Assisted = EpsonSimulator | SoftMotionSimulator
"""A simulator with a simulated person."""

_LONGEST_ANSWER: Final = 1 << 23
"""Longest answer in bytes. The recorded history and the queued faults, which answers list, are
bounded.
"""

_IN_PROCESS: Final[Mapping[str, Callable[[str], Assisted]]] = {
    "epson+sim": in_process.simulator_named,
    "softmotion+sim": plc_in_process.simulator_named,
}


class AssistHost(TcpHost):
    """A listening assist port; its URL holds the token."""

    def __init__(self, simulator: Assisted, port: int, clock: ScaledClock, token: str) -> None:
        self._assisting = _AssistDevice(simulator, clock, token)
        super().__init__(
            self._assisting,
            SCHEME,
            ("127.0.0.1", port),
            clock=clock,
            lock=simulator.lock,
        )
        self.url = self.url.replace("://", f"://{token}@")

    @property
    def requests(self) -> int:
        """The number of lines received, from any client."""
        return self._assisting.requests


def serve_assist(
    simulator: Assisted, *, port: int = 0, clock: ScaledClock, token: str | None = None
) -> AssistHost:
    """Serve the assist port of a simulator, on loopback only.

    Args:
        simulator: Whose world.
        port: Port, 0 for a free one.
        clock: The clock on which the simulator is served.
        token: What its URL holds; drawn when it is left out.

    Raises:
        ConnectError: The port is taken.
    """
    return AssistHost(simulator, port, clock, drawn_token() if token is None else token)


class _AssistDevice:
    """Implements :class:`~robolink_simulators.hosting.addresses.WireDevice`."""

    def __init__(self, simulator: Assisted, clock: ScaledClock, token: str) -> None:
        self.cell = ControlledCell(simulator, clock)
        self.clock = clock
        self.token = token
        self.requests = 0
        self._links: list[_AssistLink] = []

    def connect(self, now_ns: int) -> "_AssistLink":  # noqa: ARG002 - time plays no part
        link = _AssistLink(self)
        self._links = [other for other in self._links if not other.closed]
        if len(self._links) >= MOST_CLIENTS:
            waiting = (other for other in self._links if not other.let_in)
            next(waiting, link).closed = True
        self._links.append(link)
        return link

    def advance(self, now_ns: int) -> None:
        """Do nothing: nothing here happens by itself."""

    def next_change(self) -> int | None:
        return None


class _AssistLink:
    """Implements :class:`~robolink_simulators.hosting.addresses.DeviceLink`."""

    def __init__(self, device: _AssistDevice) -> None:
        self._device = device
        self._held = b""
        self._out = b""
        self.let_in = False
        self.closed = False

    def receive(self, data: bytes, now_ns: int) -> None:
        if not data:
            self.closed = True
        *lines, self._held = (self._held + data).split(b"\n")
        for line in lines:
            if not self.closed:
                self._device.requests += 1
                self._device.cell.simulator.advance(now_ns)
                self._out += self._answered(line)
        if len(self._held) > LONGEST_LINE:
            self.closed = True

    def outgoing(self) -> bytes:
        out, self._out = self._out, b""
        return out

    def _answered(self, line: bytes) -> bytes:
        try:
            request = json.loads(line) if len(line) <= LONGEST_LINE else None
        except (ValueError, RecursionError):
            request = None
        if not isinstance(request, dict):
            self.closed = True
            return b""
        try:
            answer = self._performed(request) if self.let_in else self._entered(request)
        except RobolinkError as error:
            answer = {"ok": False, "error": error.what, "remedy": error.remedy}
        except MACHINE_REFUSALS as refused:
            what, remedy = machine_refusal(refused)
            answer = {"ok": False, "error": what, "remedy": remedy}
        except Exception as error:
            # The client gets the error and the port stays open, as in the control API.
            what, remedy = defect(error)
            answer = {"ok": False, "error": what, "remedy": remedy}
        return json.dumps(answer).encode() + b"\n"

    def _entered(self, request: dict[str, Any]) -> dict[str, Any]:
        self.let_in = is_token(request.get("token"), self._device.token)
        if self.let_in:
            return {"ok": True}
        self.closed = True
        return {"ok": False, "error": tr("That is not the token of this simulator.")}

    def _performed(self, request: dict[str, Any]) -> dict[str, Any]:
        answer: dict[str, Any] = {"ok": True, **perform(self._device.cell, request)}
        if "thinks_s" in answer:
            answer["thinks_s"] = self._real_thinking_s(answer["thinks_s"])
        return answer

    def _real_thinking_s(self, thinks_s: float) -> float:
        """Return how long they think in real time, which the client uses."""
        return max(self._device.clock.really_takes_s(thinks_s), min(thinks_s, LEAST_THINKING_S))


class AssistClient(ClosedAtExit):
    """Talks to an assist port.

    Args:
        url: ``assist+tcp://TOKEN@127.0.0.1:PORT``.
        timeout_s: Longest wait for an answer.

    Raises:
        ConfigError: It is not an assist URL, or its token is not that of the simulator.
        ConnectError: Nobody listens there.
        TransportError, RemoteProtocolError: What listens gives no answer, or that of no simulator.
    """

    def __init__(self, url: str, *, timeout_s: float = 5.0) -> None:
        address = assist_address(url)
        self._url = address.shown
        self._timeout_s = timeout_s
        try:
            self._socket = socket.create_connection((address.host, address.port), timeout_s)
        except OSError as error:
            raise nobody_listens(self._url) from error
        self._lines = self._socket.makefile("rb")
        try:
            self._enter(address.token)
        except BaseException:
            self.close()
            raise

    def do(self, act: str, **parameters: object) -> dict[str, Any]:
        """Carry out an act and return its result.

        Raises:
            ConfigError: The simulator cannot do it, and says why.
            TransportBrokenError: The simulator is gone.
            TransportTimeoutError: No answer came in time; whether it was done is not known.
            RemoteProtocolError: What answers is no simulator.
        """
        answer = self._asked({"do": act, **parameters})
        if not answer.pop("ok"):
            raise ConfigError(str(answer["error"]), remedy=str(answer.get("remedy", "")))
        return answer

    def look(self, tool: int | None = None) -> PersonLook:
        """Return the vector, in base axes, that the operator sees from the tip to the pin."""
        return PersonLook(**(self.do("look") if tool is None else self.do("look", tool=tool)))

    def way_along(self, axis: Axis, length_mm: float, tool: int) -> XyzMm:
        """Return the vector, in base axes, that the operator sees along an axis of a tool."""
        answer = self.do("way_along", axis=axis, length_mm=length_mm, tool=tool)
        x_mm, y_mm, z_mm = answer["way_mm"]
        return x_mm, y_mm, z_mm

    def be_asked(self, *, touch: bool, tool: int) -> PersonManner:
        """Ask the operator something, and return how the operator handles it.

        Args:
            touch: Whether they are to bring a tip onto the pin.
            tool: Whose.
        """
        return PersonManner(**self.do("be_asked", touch=touch, tool=tool))

    def jog_onto_pin(self) -> dict[str, float]:
        """Jog the tip onto the pin on the pendant (Teach only); return the flange pose."""
        flange: dict[str, float] = self.do("jog_onto_pin")["flange"]
        return flange

    def see(self, mark: int) -> list[tuple[float, float, float | None]]:
        """Take a picture and return the pixels of everything that looks like a mark.

        With each the radius that was found there, ``None`` where the finder tells none.
        """
        answer = self.do("see", mark=mark)
        seen, radii_px = answer["seen"], answer.get("radii_px") or ()
        told = radii_px if len(radii_px) == len(seen) else (None,) * len(seen)
        return [(x, y, radius_px) for (x, y), radius_px in zip(seen, told, strict=True)]

    def truth(self) -> dict[str, Any]:
        """Return where the tips and the pin really are."""
        return self.do("truth")

    def close(self) -> None:
        """Close the connection."""
        self._lines.close()
        self._socket.close()

    def _enter(self, token: str) -> None:
        if not self._asked({"token": token}).get("ok"):
            raise ConfigError(
                tr("The simulator on {url} does not know the token of this URL.", url=self._url),
                remedy=tr("Take the whole URL that 'robolink sim' prints; each start has its own."),
            )

    def _asked(self, request: dict[str, object]) -> dict[str, Any]:
        try:
            self._socket.sendall(json.dumps(request).encode() + b"\n")
            line = self._lines.readline(_LONGEST_ANSWER)
        except TimeoutError as error:
            raise is_silent(self._url, self._timeout_s) from error
        except OSError as error:
            raise ended_unanswered(self._url) from error
        if not line:
            raise ended_unanswered(self._url)
        try:
            answer = json.loads(line)
        except (ValueError, RecursionError) as error:
            raise is_no_simulator(self._url) from error
        if not isinstance(answer, dict) or "ok" not in answer:
            raise is_no_simulator(self._url)
        return answer


class InProcessEyes:
    """Looks at a simulator of this process, as :class:`AssistClient` does at a served one."""

    def __init__(self, simulator: Assisted) -> None:
        self._simulator = simulator

    def look(self, tool: int | None = None) -> PersonLook:
        """Return the vector, in base axes, that the operator sees from the tip to the pin."""
        with self._simulator.lock:
            return self._simulator.world.operator.look(tool)

    def way_along(self, axis: Axis, length_mm: float, tool: int) -> XyzMm:
        """Return the vector, in base axes, that the operator sees along an axis of a tool."""
        with self._simulator.lock:
            return self._simulator.world.operator.way_along(axis, length_mm, tool)

    def be_asked(self, *, touch: bool, tool: int) -> PersonManner:
        """Ask the operator something, and return how the operator handles it."""
        with self._simulator.lock:
            operator = self._simulator.world.operator
            return operator.begin_touch(tool) if touch else operator.be_asked()


def simulator_at(url: str) -> Assisted:
    """Return the simulator of this process that a sim URL names.

    Raises:
        ConfigError: It is no sim URL, or no simulator has that name.
    """
    parts = urlsplit(url)
    named = _IN_PROCESS.get(parts.scheme)
    if named is None:
        raise ConfigError(
            tr("{url!r} is not a sim URL.", url=url),
            remedy=known_names(f"{it}://NAME" for it in _IN_PROCESS),
        )
    return named(parts.hostname or "")


@contextmanager
def open_eyes(url: str) -> Iterator[AssistClient | InProcessEyes]:
    """Open the operator's eyes on a simulator.

    Args:
        url: An assist URL, or that of a simulator of this process: ``epson+sim://NAME`` or
            ``softmotion+sim://NAME``.

    Raises:
        ConfigError: It is neither, or no simulator has that name.
        ConnectError: Nobody listens there.
    """
    if urlsplit(url).scheme in _IN_PROCESS:
        yield InProcessEyes(simulator_at(url))
    else:
        with AssistClient(url) as client:
            yield client
