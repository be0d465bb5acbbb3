"""Listens, in a process that has a controller, for the stop from a second terminal.

EPSON serves one client (docs/reference/epson.md 1.1), a serial line is opened once, and a CANopen
node answers one at a time. So whoever has the controller is the one who can stop it: it listens on
a local socket, for its own user only, and stops on request. Where the system has no such sockets,
or the path is too long for one, it listens on the loopback address, and a token in a file that only
this user can read opens it.

The thread that listens does nothing but ``controller.stop()``, which any thread may call. Who only
wants to look asks another socket, with a thread of its own: it answers with the state that was read
last and its age, reads nothing for it and takes no lock, so that neither the work nor a stop waits
for those who look on.
"""

import json
import os
import selectors
import socket
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import asdict
from pathlib import Path
from typing import Final, Protocol, Self

from robolink import runtime
from robolink.controllers import stop_now
from robolink.controllers.stop_attempts import Stoppable
from robolink.errors import RobolinkError
from robolink.files.durable import make_folder, state_folder
from robolink.interrupts import ClosedAtExit
from robolink.journal import this_process
from robolink.messages import tr
from robolink.model import ControllerStatus, is_own_name
from robolink.plug_ins import unexpected
from robolink.timing import NS_PER_S, wall_label
from robolink.transport import far_end_of

KIND: Final = "holders"

MOST_BYTES: Final = 4096
"""Largest number of bytes of a request."""

_HEARD_S: Final = 1.0
_LAST_ANSWER_S: Final = 10.0
"""Longest wait for an answer in progress before the socket is closed, in s."""

_LONGEST_PATH: Final = 100
"""Largest number of bytes of a socket's path; Linux allows 107, other systems 103."""

Answer = Callable[[socket.socket, dict[str, object]], None]
"""Answers a caller that has the token."""


class Seen(Protocol):
    """The last reading of a controller; another thread asks for it, without a lock."""

    def __call__(self) -> tuple[ControllerStatus, int] | None:
        """Return the state and its age in nanoseconds; ``None`` for never."""


class StopListener(ClosedAtExit):
    """Listens while this process has a controller; a context manager.

    Leave it before the controller is closed: it then waits for a stop that is under way.

    Args:
        controller: What is stopped.
        url: How it was reached.
        who: Who holds it, and for what, as a person is told.
        name: Under which name the controller is on record (``controller.outcomes.identity``), so
            that a stop finds it by another address, too; empty where that is not known.
        heard: Called with who asked for it, in the listener's thread, after the stop; what it
            raises is lost.
        seen: What others may see of it; ``None`` lets nobody look.

    Raises:
        OSError: There is no place to listen.

    Example:
        >>> from robolink.stopping import StopListener, holders_of
        >>> from robolink.transport import far_end_of
        >>> from robolink.controllers import SimpleController
        >>> url = "epson+tcp://192.168.0.1:5000"
        >>> with SimpleController(identity=url) as controller:
        ...     with StopListener(controller, url, who="K. Sato, calibrating"):
        ...         [holder.who for holder in holders_of(far_end_of(url))]
        ['K. Sato, calibrating']
    """

    def __init__(
        self,
        controller: Stoppable,
        url: str,
        *,
        who: str = "",
        name: str = "",
        heard: Callable[[str], None] | None = None,
        seen: Seen | None = None,
    ) -> None:
        self._controller = controller
        self._heard = heard
        self._seen = seen
        token = _new_token()
        path = _path_of(token)
        self._card = path.with_suffix(".json")
        stop = _LocalServer(path.with_suffix(".sock"), {token: self._stop}, "robolink-stop")
        self._servers = [stop]
        card = _card(url, name, who, token, stop.place)
        try:
            if seen is not None:
                look = _LocalServer(path.with_suffix(".look"), {token: self._show}, "robolink-look")
                self._servers.append(look)
                card["look"] = look.place
            _publish(self._card, card)
        except BaseException:
            self._end_servers()
            raise

    def close(self) -> None:
        """Stop listening, after a stop in progress has been answered. Idempotent."""
        self._end_servers()
        self._card.unlink(missing_ok=True)

    def _end_servers(self) -> None:
        for server in self._servers:
            server.close()

    def _show(self, caller: socket.socket, _asked: dict[str, object]) -> None:
        found = self._seen() if self._seen else None
        if found is None:
            _tell(caller, {"status": None})
        else:
            _tell(caller, {"status": asdict(found[0]), "age_s": found[1] / NS_PER_S})

    def _stop(self, caller: socket.socket, asked: dict[str, object]) -> None:
        _stopped(self._controller, self._heard, caller, asked)


class SharedStopListener(ClosedAtExit):
    """Listens at one socket for stops of many controllers, each of which is held for a moment.

    For a process that looks at many cells at once: a socket and a thread for each would cost more
    than the look. Each request is answered in a thread of its own, so that no stop waits for
    another. A context manager.

    Args:
        who: Who holds the controllers, and for what, as a person is told.
        heard: Called with the URL and with who asked, after a stop; what it raises is lost.

    Raises:
        OSError: There is no place to listen.

    Example:
        >>> from robolink.controllers import SimpleController
        >>> from robolink.stopping import SharedStopListener, holders_of
        >>> from robolink.transport import far_end_of
        >>> url = "epson+tcp://192.168.0.1:5000"
        >>> with SharedStopListener(who="the nightly check") as listener:
        ...     with SimpleController(identity=url) as controller:
        ...         with listener.listening(controller, url):
        ...             [holder.who for holder in holders_of(far_end_of(url))]
        ['the nightly check']
    """

    def __init__(self, *, who: str = "", heard: Callable[[str, str], None] | None = None) -> None:
        self._who, self._heard = who, heard
        self._answers: dict[str, Answer] = {}
        path = _path_of(_new_token()).with_suffix(".sock")
        self._server = _LocalServer(path, self._answers, "robolink-stop", apart=True)

    @classmethod
    def telling(cls, tell: Callable[[str], None], *, who: str) -> Self | None:
        """Return one that tells of each stop; ``None`` where there is no place to listen.

        Args:
            tell: Receives the sentences: who stopped what, or that no stop can reach this process.
            who: Who holds the controllers, and for what, as a person is told.
        """
        try:
            return cls(
                who=who,
                heard=lambda url, by: tell(
                    tr("{url}: stopped from another terminal by {who}.", url=url, who=by)
                ),
            )
        except OSError as error:
            tell(no_place_to_listen(error))
            return None

    def close(self) -> None:
        """Stop listening. Idempotent."""
        self._server.close()

    @contextmanager
    def listening(self, controller: Stoppable, url: str, *, name: str = "") -> Iterator[None]:
        """Hear stops of one more controller for the block.

        Leave it before the controller is closed; a stop in progress then goes on to its end.

        Args:
            controller: What is stopped.
            url: How it was reached.
            name: Under which name it is on record; empty where that is not known.

        Raises:
            OSError: Its address cannot be left for others.

        Example:
            >>> from robolink.controllers import SimpleController
            >>> from robolink.stopping import SharedStopListener
            >>> url = "epson+tcp://192.168.0.1:5000"
            >>> with SharedStopListener() as listener, SimpleController(identity=url) as controller:
            ...     with listener.listening(controller, url, name="epson:C-1/R-1"):
            ...         controller.status().ready
            True
        """
        heard = self._heard
        token, told = _new_token(), None if heard is None else lambda who: heard(url, who)
        card = _path_of(token).with_suffix(".json")
        self._answers[token] = lambda caller, asked: _stopped(controller, told, caller, asked)
        try:
            _publish(card, _card(url, name, self._who, token, self._server.place) | {"brief": True})
            yield
        finally:
            card.unlink(missing_ok=True)
            del self._answers[token]


def no_place_to_listen(error: OSError) -> str:
    """Return what a person is told where no listener can be."""
    return tr(
        "'robolink stop' in another terminal cannot reach this command: {cause}.",
        cause=error.strerror or error,
    )


def _new_token() -> str:
    return runtime.random_bytes(16).hex()


def _path_of(token: str) -> Path:
    """Return the path of the files of one listener, without their endings; makes the folder."""
    folder = state_folder(KIND)
    make_folder(folder)
    return folder / f"{os.getpid()}-{token[:8]}"


def _card(url: str, name: str, who: str, token: str, place: object) -> dict[str, object]:
    own = name if is_own_name(name) else ""
    return {
        "keys": sorted(far_end_of(url) | ({own} if own else set())),
        "controller": own,
        "place": place,
        "token": token,
        "pid": os.getpid(),
        "who": who,
        "process": asdict(this_process()),
        "since": wall_label(),
    }


def _publish(path: Path, card: dict[str, object]) -> None:
    """Write the address to contact; not synced to the disk: it ends with the process."""
    draft = path.with_suffix(".new")
    descriptor = os.open(draft, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    with open(descriptor, "w", encoding="utf-8") as file:
        file.write(json.dumps(card))  # a tenth of what json.dump takes
    os.replace(draft, path)


def _stopped(
    controller: Stoppable,
    heard: Callable[[str], None] | None,
    caller: socket.socket,
    asked: dict[str, object],
) -> None:
    """Stop a controller, and tell the caller how that ended."""
    _tell(caller, {"taken": True})
    try:
        _tell(caller, {"state": str(stop_now(controller).state)})
    except RobolinkError as error:
        _tell(
            caller,
            {"error": type(error).__name__, "what": error.what, "remedy": error.remedy},
        )
    except Exception as error:
        what = unexpected(error)
        _tell(caller, {"error": "OutcomeUnknownError", "what": what, "remedy": ""})
    # Last, because a blocked console must not delay a stop. If it fails, nothing ends: the
    # result of the stop has been sent, and the next request must be heard.
    with suppress(Exception):
        if heard:
            heard(str(asked.get("who", "")))


class _LocalServer(ClosedAtExit):
    """Serves one request after the other, in a thread of its own; a context manager.

    Args:
        path: Where to listen, if that can be.
        answers: What is answered to each token that opens it; they raise nothing. Others may be
            added meanwhile.
        name: Of the thread.
        apart: Whether each request gets a further thread, so that none waits for another.

    Raises:
        OSError: There is no place to listen.
    """

    def __init__(
        self, path: Path, answers: Mapping[str, Answer], name: str, *, apart: bool = False
    ) -> None:
        self._answers, self._apart = answers, apart
        self._socket, self._path = _listening(path)
        self._wake, self._awake = socket.socketpair()
        self._thread = threading.Thread(target=self._listen, name=name, daemon=True)
        self._thread.start()

    @property
    def place(self) -> str | list[object]:
        """Path of the socket, or address and port."""
        return self._path or list(self._socket.getsockname())

    def close(self) -> None:
        """Stop listening, after an answer in progress. Idempotent."""
        with suppress(OSError):
            self._wake.send(b"\0")
        self._thread.join(_LAST_ANSWER_S)
        if self._path:
            Path(self._path).unlink(missing_ok=True)
        for one in (self._socket, self._wake, self._awake):
            one.close()

    def _listen(self) -> None:
        # No plain select: it accepts no descriptor above 1023, and the host process may have more.
        with selectors.DefaultSelector() as selector:
            for one in (self._socket, self._awake):
                selector.register(one, selectors.EVENT_READ)
            while self._awake not in [key.fileobj for key, _ in selector.select()]:
                with suppress(OSError):  # the caller has left
                    caller, _ = self._socket.accept()
                    if self._apart:
                        name = f"{self._thread.name} answer"
                        threading.Thread(
                            target=self._hear, args=(caller,), name=name, daemon=True
                        ).start()
                    else:
                        self._hear(caller)

    def _hear(self, caller: socket.socket) -> None:
        from hmac import compare_digest  # imported here, because most commands never get a request

        with suppress(OSError), caller:  # the caller has left
            asked = _read_line(caller)
            # As bytes: for text that is not ASCII it raises an error that would end the listener.
            shown = str(asked.get("token", "")).encode("utf-8", "surrogatepass")
            for token, answer in list(self._answers.items()):
                if compare_digest(shown, token.encode()):
                    answer(caller, asked)


def _tell(caller: socket.socket, answer: dict[str, object]) -> None:
    """Send one line; the caller may have left.

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
            path.chmod(0o600)  # the folder was already accessible only to its owner
            listening.listen()
        except OSError:
            listening.close()
        else:
            return listening, str(path)
    return socket.create_server(("127.0.0.1", 0)), ""


def _read_line(caller: socket.socket) -> dict[str, object]:
    data = b""
    # One deadline for the whole line: a caller that sends byte by byte must not delay the next one.
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
