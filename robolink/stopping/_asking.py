"""Asks the process that has a controller to stop it."""

import json
import os
import socket
import time
from collections.abc import Iterator, Mapping, Set
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Final

from robolink import errors
from robolink.files.durable import state_folder
from robolink.messages import tr

if TYPE_CHECKING:
    from robolink.model import ControllerStatus


KIND: Final = "holders"
MOST_BYTES: Final = 65_536

_TAKEN_S: Final = 1.0
"""Longest wait for a process to accept the request, in s; a slower one is of no use."""

_AGAIN_S: Final = 0.05
"""Pause between two looks at who has a controller, in s."""

_RESTS_S: Final = 8.0
"""Longest wait for the end of an accepted stop, in s: five seconds to stop, plus the exchanges."""


@dataclass(frozen=True, slots=True)
class LastSeen:
    """The last reading of a controller by the process that has it.

    Attributes:
        status: The state flags.
        age_s: How many seconds ago it read them.
    """

    status: "ControllerStatus"
    age_s: float


@dataclass(frozen=True, slots=True)
class ControllerHolder:
    """A process on this computer that has a controller, and listens.

    Attributes:
        place: Path of its socket, or address and port.
        token: What opens it.
        pid: Its number.
        who: Who it is, and what it does, as a person is told.
        controller: Which controller that is, as it said of itself; empty where it did not.
        card: The file that says so.
        look: Where to look at what it saw last; ``None`` where it lets nobody look.
        since: Since when it has the controller, as a label; empty where it did not say.
        process: Which process it is, as :class:`robolink.journal.LeaseHolder` takes it.
        brief: Whether it has the controller for a moment only, to check it.
        keys: Far end and own name of the controller.
    """

    place: str | tuple[str, int]
    token: str
    pid: int
    who: str
    controller: str
    card: Path
    look: str | tuple[str, int] | None = None
    since: str = ""
    process: Mapping[str, object] = field(default_factory=dict, hash=False)
    brief: bool = False
    keys: frozenset[str] = frozenset()

    def last_seen(self) -> LastSeen | None:
        """Return its last reading of its controller; ``None`` if it has none yet.

        Nothing is read from the controller for it, and the work there does not wait.

        Raises:
            HolderGoneError: It does not answer, or lets nobody look.
        """
        if self.look is None:
            raise HolderGoneError(self.pid)
        try:
            with _reached(self.look) as line, line.makefile("rwb") as talk:
                talk.write(json.dumps({"token": self.token}).encode() + b"\n")
                talk.flush()
                said = _answer(talk.readline(MOST_BYTES))
        except OSError as error:
            raise HolderGoneError(self.pid) from error
        return self._understood(said)

    def _understood(self, said: dict[str, object]) -> LastSeen | None:
        from robolink.model import ControllerStatus  # here, because a stop does not need it

        try:
            status = said["status"]
            if status is None:
                return None
            if not isinstance(status, dict):
                raise TypeError
            known = {key: status[key] for key in ControllerStatus.__dataclass_fields__}
            return LastSeen(ControllerStatus(**known), float(str(said["age_s"])))
        except (KeyError, TypeError, ValueError) as error:
            raise HolderGoneError(self.pid) from error

    def ask_to_stop(self, who: str) -> str:
        """Ask it to stop its controller; return the state that confirms the stop.

        Args:
            who: Who asks, as the person at the other terminal is told.

        Raises:
            HolderGoneError: It does not take the request; nothing was done.
            OutcomeUnknownError: It took the request and did not say how it ended.
            RobolinkError: What its stop raised.
        """
        try:
            line = self._knock()
        except OSError as error:
            raise HolderGoneError(self.pid) from error
        with line, line.makefile("rwb") as talk:
            try:
                talk.write(json.dumps({"token": self.token, "who": who}).encode() + b"\n")
                talk.flush()
                if not _answer(talk.readline(MOST_BYTES)).get("taken"):
                    raise HolderGoneError(self.pid)
            except OSError as error:
                raise HolderGoneError(self.pid) from error
            try:
                line.settimeout(_RESTS_S)
                end = _answer(talk.readline(MOST_BYTES))
            except OSError:
                end = {}
        return self._state(end)

    def _knock(self) -> socket.socket:
        return _reached(self.place)

    def _state(self, end: dict[str, object]) -> str:
        if "state" in end:
            return str(end["state"])
        what, remedy = str(end.get("what", "")), str(end.get("remedy", ""))
        kind = getattr(errors, str(end.get("error", "")), None)
        if kind in _TOLD:
            raise kind(what, remedy=remedy)
        raise errors.OutcomeUnknownError(
            what
            or tr(
                "The process that has locked the controller ({pid}) accepted the stop but "
                "did not report how it ended.",
                pid=self.pid,
            ),
            remedy=remedy or tr("It may still be moving."),
        )


_TOLD: Final = (
    errors.ConnectError,
    errors.TransportTimeoutError,
    errors.TransportClosedError,
    errors.TransportBrokenError,
    errors.RemoteProtocolError,
    errors.RejectedError,
)


class HolderGoneError(Exception):
    """A process that should have the controller does not accept a request."""

    def __init__(self, pid: int) -> None:
        super().__init__(pid)
        self.pid = pid


def holders_of(keys: Set[str] | None, *, others: bool = False) -> Iterator[ControllerHolder]:
    """Yield the processes on this computer that have a controller, the latest first.

    Args:
        keys: Its far end (:func:`~robolink.transport.far_end_of`), and its own name where that is
            known; ``None`` for all controllers.
        others: Whether this process does not count.

    What a process that is gone has left is taken away.
    """
    folder, own = state_folder(KIND), f"{os.getpid()}-"
    try:
        cards = [
            Path(entry)
            for entry in os.scandir(folder)
            if entry.name.endswith(".json") and not (others and entry.name.startswith(own))
        ]
    except OSError:
        return
    for card in sorted(cards, key=_age):
        holder = _read(card, keys)
        if holder is not None:
            yield holder


def await_brief_holders(keys: Set[str], *, within_s: float) -> None:
    """Wait until no other process has a controller for a moment only, to check it.

    Whoever then finds it taken was kept out by somebody who works there.

    Args:
        keys: As for :func:`holders_of`.
        within_s: Longest wait.
    """
    until = time.monotonic() + within_s
    while any(one.brief for one in holders_of(keys, others=True)) and time.monotonic() < until:
        time.sleep(_AGAIN_S)


def _read(card: Path, keys: Set[str] | None) -> ControllerHolder | None:
    try:
        said = json.loads(card.read_bytes())
        held, place, pid = set(said["keys"]), said["place"], int(said["pid"])
        if keys is not None and not held & keys:
            return None
        if _is_gone(pid):
            card.unlink()
            for left in (card.with_suffix(".sock"), card.with_suffix(".look"), _shared(place)):
                if left.parent == card.parent:
                    left.unlink(missing_ok=True)
            return None
        look = said.get("look")
        return ControllerHolder(
            _place(place),
            str(said["token"]),
            pid,
            str(said["who"]),
            str(said.get("controller", "")),
            card,
            None if look is None else _place(look),
            str(said.get("since", "")),
            dict(said.get("process", {})),
            brief=said.get("brief") is True,
            keys=frozenset(map(str, held)),
        )
    except (OSError, ValueError, TypeError, KeyError, IndexError, RecursionError):
        return None


def _shared(place: object) -> Path:
    """Return the socket that a card names, which other cards may name too; else no file."""
    return Path(place) if isinstance(place, str) else Path()


def _place(said: object) -> str | tuple[str, int]:
    if isinstance(said, list):
        return str(said[0]), int(said[1])
    return str(said)


def _reached(place: str | tuple[str, int]) -> socket.socket:
    if isinstance(place, str):
        line = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    else:
        line = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    line.settimeout(_TAKEN_S)
    try:
        line.connect(place)
    except OSError:
        line.close()
        raise
    return line


def _is_gone(pid: int) -> bool:
    if os.name != "posix":
        return False  # there, signal 0 would end the process
    with suppress(PermissionError):
        try:
            os.kill(pid, 0)
        except ProcessLookupError:
            return True
    return False


def _age(card: Path) -> float:
    try:
        return time.time() - card.stat().st_mtime
    except OSError:
        return 0.0


def _answer(line: bytes) -> dict[str, object]:
    try:
        told = json.loads(line)
    except (ValueError, RecursionError):
        return {}
    return told if isinstance(told, dict) else {}
