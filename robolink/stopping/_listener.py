"""A process that holds a controller listens for the stop from a second terminal.

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
import socket
from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict
from typing import Final, Protocol

from robolink import ambient
from robolink.closing import ClosedAtExit
from robolink.errors import RobolinkError
from robolink.files.durable import make_folder, state_folder
from robolink.messages import tr
from robolink.model import ControllerStatus, is_own_name
from robolink.stopping._far_end import far_end_of
from robolink.stopping._local_socket import LocalServer, tell
from robolink.timing import NS_PER_S

KIND: Final = "holders"


class Stoppable(Protocol):
    """What the listener needs of a controller."""

    def stop(self) -> None:
        """Bring it to rest; any thread may call it."""

    def status(self) -> ControllerStatus:
        """Read its state."""


class Seen(Protocol):
    """What was seen of a controller last; looked up by another thread, without a lock."""

    def __call__(self) -> tuple[ControllerStatus, int] | None:
        """Return the state, and how many nanoseconds old it is; ``None`` for never."""


class StopListener(ClosedAtExit):
    """Listens while a controller is held; a context manager.

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
        >>> from robolink.stopping import StopListener, far_end_of, holders_of
        >>> from robolink.testing import MemoryController
        >>> url = "epson+tcp://192.168.0.1:5000"
        >>> with MemoryController(identity=url) as controller:
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
        token = ambient.random_bytes(16).hex()
        folder = state_folder(KIND)
        make_folder(folder)
        file = f"{os.getpid()}-{token[:8]}"
        own = name if is_own_name(name) else ""
        self._card = folder / f"{file}.json"
        self._servers = [LocalServer(folder / f"{file}.sock", token, self._stop, "robolink-stop")]
        card: dict[str, object] = {
            "keys": sorted(far_end_of(url) | ({own} if own else set())),
            "controller": own,
            "place": self._servers[0].place,
            "token": token,
            "pid": os.getpid(),
            "who": who,
        }
        try:
            if seen is not None:
                look = LocalServer(folder / f"{file}.look", token, self._show, "robolink-look")
                self._servers.append(look)
                card["look"] = look.place
            self._publish(card)
        except BaseException:
            self._end_servers()
            raise

    def close(self) -> None:
        """Stop listening, after a stop that is under way has been answered. Idempotent."""
        self._end_servers()
        self._card.unlink(missing_ok=True)

    def _end_servers(self) -> None:
        for server in self._servers:
            server.close()

    def _publish(self, card: dict[str, object]) -> None:
        """Write where to knock; not synced to the disk, because it dies with the process."""
        draft = self._card.with_suffix(".new")
        descriptor = os.open(draft, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
        with open(descriptor, "w", encoding="utf-8") as file:
            json.dump(card, file)
        os.replace(draft, self._card)

    def _show(self, caller: socket.socket, _asked: dict[str, object]) -> None:
        found = self._seen() if self._seen else None
        if found is None:
            tell(caller, {"status": None})
        else:
            tell(caller, {"status": asdict(found[0]), "age_s": found[1] / NS_PER_S})

    def _stop(self, caller: socket.socket, asked: dict[str, object]) -> None:
        tell(caller, {"taken": True})
        try:
            self._controller.stop()
            tell(caller, {"state": str(self._controller.status().state)})
        except RobolinkError as error:
            tell(
                caller,
                {"error": type(error).__name__, "what": error.what, "remedy": error.remedy},
            )
        except Exception as error:
            what = tr(
                "A defect in robolink: {kind}: {error}", kind=type(error).__name__, error=error
            )
            tell(caller, {"error": "OutcomeUnknownError", "what": what, "remedy": ""})
        # Last: a console that is held up must not hold up a stop. And one that fails ends nothing:
        # how the stop ended has been told, and the next one has to be heard.
        with suppress(Exception):
            if self._heard:
                self._heard(str(asked.get("who", "")))
