"""Serves a recorded dialogue: answers what was recorded, refuses what differs.

A live dialogue turned into a test. The requests must come as they were recorded, byte for
byte and in order; each lets go what was received after it. Time does not count, and neither
does the password: any login is answered as the recorded one was.
"""

import threading
from collections.abc import Callable
from pathlib import Path
from typing import Final

from robolink.errors import ConfigError
from robolink.files.named import read_named
from robolink.messages import tr
from robolink.transport import Dialogue, Passage, parse_dialogues
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.hosting.streams.tcp_host import TcpHost

_LOGIN: Final = b"$login,"
_SHOWN: Final = 200


class ReplayDevice:
    """Implements :class:`~robolink_simulators.hosting.addresses.WireDevice`.

    Args:
        dialogues: One for each connection that a client will make, in order.
        on_difference: Told about every difference, in the host's thread.

    Attributes:
        lock: Held while the device is touched.
        differences: What clients did otherwise than recorded, in words.
    """

    def __init__(
        self,
        dialogues: tuple[Dialogue, ...],
        *,
        on_difference: Callable[[str], None] | None = None,
    ) -> None:
        self.lock = threading.RLock()
        self.differences: list[str] = []
        self._dialogues = dialogues
        self._on_difference = on_difference
        self._connections = 0

    @property
    def unplayed(self) -> int:
        """How many recorded connections no client has made yet."""
        return max(0, len(self._dialogues) - self._connections)

    def connect(self, now_ns: int) -> "ReplayLink":  # noqa: ARG002 - time does not count here
        """Accept a client; past the last recorded connection it is cut off at once."""
        self._connections += 1
        if self._connections > len(self._dialogues):
            self.differ(
                tr(
                    "Connection {number} was not recorded; the recording holds {count}.",
                    number=self._connections,
                    count=len(self._dialogues),
                )
            )
            return ReplayLink(self, None)
        return ReplayLink(self, self._dialogues[self._connections - 1])

    def advance(self, now_ns: int) -> None:
        """Do nothing: nothing happens by itself."""

    def next_change(self) -> None:
        """Return ``None``: nothing happens by itself."""

    def differ(self, what: str) -> None:
        """Note a difference."""
        self.differences.append(what)
        if self._on_difference is not None:
            self._on_difference(what)


class ReplayLink:
    """A :class:`~robolink_simulators.hosting.addresses.DeviceLink`; ``None`` is cut at once."""

    def __init__(self, device: ReplayDevice, dialogue: Dialogue | None) -> None:
        self._device = device
        self._left = list(dialogue.passages) if dialogue else []
        self._arrived = b""
        self._outgoing = b""
        self._asked = 0
        self._skip_lf = False
        self._over = dialogue is None
        self._let_go()

    @property
    def closed(self) -> bool:
        """Whether the recording, or a difference, has ended this connection."""
        return self._over

    def receive(self, data: bytes, now_ns: int) -> None:  # noqa: ARG002 - time does not count here
        """Compare what a client sends with what was recorded."""
        if self._over:
            return
        if not data:
            self._leave()
            return
        self._arrived += data
        while self._arrived and not self._over and self._take():
            self._let_go()

    def outgoing(self) -> bytes:
        """Take what is to be sent to the client."""
        data, self._outgoing = self._outgoing, b""
        return data

    def _take(self) -> bool:
        """Use up the next recorded request; False while it has not arrived whole."""
        if self._skip_lf:
            self._skip_lf = False
            self._arrived = self._arrived.removeprefix(b"\n")
            if not self._arrived:
                return False
        if not self._left:
            self._differ(tr("nothing more was recorded"))
            return False
        recorded = self._left[0]
        return self._take_login() if recorded.secret else self._take_request(recorded)

    def _take_request(self, recorded: Passage) -> bool:
        if self._arrived.startswith(recorded.data):
            self._use_up(len(recorded.data))
            return True
        if not recorded.data.startswith(self._arrived):
            self._differ(tr("{data} was recorded", data=_shown(recorded.data)))
        return False

    def _take_login(self) -> bool:
        if not _is_login(self._arrived):
            self._differ(tr("a login was recorded"))
            return False
        ends = [at for mark in b"\r\n" if (at := self._arrived.find(mark)) >= 0]
        if not ends:
            return False
        self._skip_lf = self._arrived[min(ends)] == ord("\r")
        self._use_up(min(ends) + 1)
        return True

    def _use_up(self, count: int) -> None:
        self._arrived = self._arrived[count:]
        del self._left[0]
        self._asked += 1

    def _let_go(self) -> None:
        while self._left and self._left[0].direction == "received" and not self._over:
            data = self._left.pop(0).data
            self._outgoing += data
            self._over = not data

    def _leave(self) -> None:
        self._over = True
        if waiting := [piece for piece in self._left if piece.direction == "sent"]:
            self._device.differ(
                tr(
                    "The client left after request {count}; {more} more were recorded.",
                    count=self._asked,
                    more=len(waiting),
                )
            )

    def _differ(self, recorded: str) -> None:
        self._over = True
        self._device.differ(
            tr(
                "Request {number} differs: {sent} was sent, but {recorded}.",
                number=self._asked + 1,
                sent=_shown(self._arrived),
                recorded=recorded,
            )
        )


_MOST_BYTES: Final = 256_000_000
"""Largest recording in bytes: a whole shift at ten exchanges per second."""


def read_recording(path: Path) -> tuple[Dialogue, ...]:
    """Read a file that ``--record`` wrote.

    Raises:
        ConfigError: It cannot be read, or is no recording.
    """
    try:
        text = read_named(path, most_bytes=_MOST_BYTES).decode("ascii")
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(
            tr("The recording {path} cannot be read: {cause}.", path=path, cause=_cause(error)),
            remedy=tr("Give a file that --record or --transcript has written."),
        ) from error
    dialogues = parse_dialogues(text, source=str(path))
    for dialogue in dialogues:
        kind, link, _ = dialogue.controller.partition("://")
        if link and not kind.startswith("epson+"):
            raise ConfigError(
                tr(
                    "{path} records {controller}; only an EPSON controller can be replayed.",
                    path=path,
                    controller=dialogue.controller,
                ),
                remedy=tr("Give another recording."),
            )
    return dialogues


def _cause(error: OSError | UnicodeDecodeError) -> str:
    return error.strerror or str(error) if isinstance(error, OSError) else str(error)


def serve_replay(
    device: ReplayDevice, host: str = "127.0.0.1", port: int = 0, *, allow_remote: bool = False
) -> TcpHost:
    """Serve a recording on a TCP port; close the host, or use it as a context manager.

    Raises:
        ConfigError: The address is not loopback and ``allow_remote`` is off.
        ConnectError: The port is taken, or the address is not this machine's.
    """
    return TcpHost(
        device,
        "epson+tcp",
        (host, port),
        clock=ScaledClock(),
        lock=device.lock,
        allow_remote=allow_remote,
    )


def _is_login(data: bytes) -> bool:
    start = data[: len(_LOGIN)].lower()
    return _LOGIN.startswith(start)


def _shown(data: bytes) -> str:
    if data and _is_login(data):
        return "'$Login,***'"
    return repr(data[:_SHOWN].decode("latin-1"))
