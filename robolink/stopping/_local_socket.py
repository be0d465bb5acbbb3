"""A socket of this computer on which a process hears others of its own user.

Where the system has no local sockets, or the path is too long for one, it is a port of the
loopback address; a token in a file that only this user can read opens either.
"""

import json
import os
import selectors
import socket
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Final

from robolink.closing import ClosedAtExit

MOST_BYTES: Final = 4096
"""Nothing that is asked here is longer."""

_HEARD_S: Final = 1.0
_LAST_ANSWER_S: Final = 10.0
"""Longest wait for an answer under way before the socket is closed."""

_LONGEST_PATH: Final = 100
"""Bytes of a socket's path; Linux takes 107, others 103."""

Answer = Callable[[socket.socket, dict[str, object]], None]
"""Answers one who has the token."""


class LocalServer(ClosedAtExit):
    """Hears one after the other, in a thread of its own; a context manager.

    Args:
        path: Where to listen, if that can be.
        token: What opens it.
        answer: What is answered; it raises nothing.
        name: Of the thread.

    Raises:
        OSError: There is no place to listen.
    """

    def __init__(self, path: Path, token: str, answer: Answer, name: str) -> None:
        self._token, self._answer = token, answer
        self._socket, self._path = _listening(path)
        self._wake, self._awake = socket.socketpair()
        self._thread = threading.Thread(target=self._listen, name=name, daemon=True)
        self._thread.start()

    @property
    def place(self) -> str | list[object]:
        """Path of the socket, or address and port."""
        return self._path or list(self._socket.getsockname())

    def close(self) -> None:
        """Stop listening, after an answer that is under way. Idempotent."""
        with suppress(OSError):
            self._wake.send(b"\0")
        self._thread.join(_LAST_ANSWER_S)
        if self._path:
            Path(self._path).unlink(missing_ok=True)
        for one in (self._socket, self._wake, self._awake):
            one.close()

    def _listen(self) -> None:
        # No plain select: it takes no descriptor above 1023, and whoever holds us may have more.
        with selectors.DefaultSelector() as selector:
            for one in (self._socket, self._awake):
                selector.register(one, selectors.EVENT_READ)
            while self._awake not in [key.fileobj for key, _ in selector.select()]:
                with suppress(OSError):  # whoever knocked has left
                    caller, _ = self._socket.accept()
                    with caller:
                        self._hear(caller)

    def _hear(self, caller: socket.socket) -> None:
        asked = _read_line(caller)
        from hmac import compare_digest  # here, because nobody knocks on most commands

        # As bytes: it refuses to compare text that is not ASCII, with an error that would end us.
        shown = str(asked.get("token", "")).encode("utf-8", "surrogatepass")
        if compare_digest(shown, self._token.encode()):
            self._answer(caller, asked)


def tell(caller: socket.socket, answer: dict[str, object]) -> None:
    """Send one line; whoever asked may have left.

    Args:
        caller: Who asked.
        answer: The line, plain JSON.
    """
    with suppress(OSError):
        caller.sendall(json.dumps(answer).encode() + b"\n")


def _listening(path: Path) -> tuple[socket.socket, str]:
    """Return a listening socket, and its path where it has one."""
    family = getattr(socket, "AF_UNIX", None)
    if family is not None and len(os.fsencode(path)) <= _LONGEST_PATH:
        listening = socket.socket(family, socket.SOCK_STREAM)
        try:
            listening.bind(str(path))
            path.chmod(0o600)  # the folder was its owner's alone before
            listening.listen()
        except OSError:
            listening.close()
        else:
            return listening, str(path)
    return socket.create_server(("127.0.0.1", 0)), ""


def _read_line(caller: socket.socket) -> dict[str, object]:
    data = b""
    # One deadline for the whole line: whoever drips bytes must not keep the next one waiting.
    until = time.monotonic() + _HEARD_S
    while not data.endswith(b"\n") and len(data) < MOST_BYTES:
        caller.settimeout(max(until - time.monotonic(), 0.001))
        piece = caller.recv(MOST_BYTES - len(data))
        if not piece:
            break
        data += piece
    try:
        asked = json.loads(data)
    except (ValueError, RecursionError):
        return {}
    return asked if isinstance(asked, dict) else {}
