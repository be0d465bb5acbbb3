"""The computer of a virtual cell: its processes, its disk, and failures of both."""

import shutil
import tempfile
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import ClassVar, Final, Protocol

from robolink_simulators.faults import FaultyDisk

from robolink.files.durable import state_folder
from robolink.journal import Journal, JournalOutcomeLog, LeaseHolder
from robolink.journal._places import place_of
from robolink.journal.store.store import Store
from robolink.model import Controller, Signature
from robolink.timing import Clock
from tests.soak.adversary.surroundings import SeededSurroundings


class Stopper(Protocol):
    """Receives a stop from another terminal."""

    def stop(self) -> None:
        """Stop the controller."""


_SUFFIXES: Final = ("", "-wal", "-shm")


class VirtualProcess:
    """One run of a command, with its own journal connection, and its end.

    Attributes:
        number: Its process number.
        person: The person who runs it.
        alive: Whether it runs.
        controller: The controller that it is connected to, ``None`` before and after.
        stopped_ns: The time of the acknowledged stop in it, ``None`` without one.
        put_back: Tools whose old value it has restored since, with the one request that did it: if
            its frame was lost it is sent again, with its number, and carried out once.
        cut_off: Whether a link of it has failed.
        overtaken: Whether another client was acknowledged in place of a movement or write.
        stopper: The receiver of a stop from another terminal, if not the controller.
        held_back: Whether a stop was begun in it and not released since.
    """

    def __init__(self, number: int, person: str, holder: LeaseHolder, path: Path) -> None:
        self.number = number
        self.person = person
        self.alive = True
        self.controller: Controller | None = None
        self.stopped_ns: int | None = None
        self.put_back: dict[int, str] = {}
        self.cut_off = False
        self.overtaken = False
        self.held_back = False
        self.stopper: Stopper | None = None
        self._holder = holder
        self._path = path
        self._journal: Journal | None = None

    def log(self, address: str, clock: Clock) -> JournalOutcomeLog:
        """Open the journal and return the record of a controller.

        Raises:
            JournalError: It cannot be opened.
        """
        if self._journal is not None:  # a command connects once more
            return self.log_of(address, clock)
        place = place_of(str(self._path))
        store = Store(place, read_only=False)
        self._journal = Journal(store, place.location, read_only=False)
        store.open()
        return self.log_of(address, clock)

    def log_of(self, controller: str, clock: Clock) -> JournalOutcomeLog:
        """Return the record of another controller in the open journal."""
        assert self._journal is not None  # for the type: it was opened
        signature = Signature(
            os_user=self.person, host="cell-pc", version="soak", operator=self.person
        )
        return self._journal.log(controller, signature=signature, holder=self._holder, clock=clock)

    def end(self) -> None:
        """End, voluntarily or not: the system closes everything open."""
        self.alive = False
        self.controller = None
        if self._journal is not None:
            self._journal.close()
            self._journal = None


class VirtualComputer:
    """A PC with a disk; its power may fail, and its disk may lose accepted data.

    Args:
        folder: A new folder for all its files.
        surroundings: Its clocks.

    Attributes:
        journal: The journal's file.
        boots: How often it was switched on.
    """

    def __init__(self, folder: Path, surroundings: SeededSurroundings) -> None:
        self.journal = folder / "journal.db"
        self.boots = 1
        self._surroundings = surroundings
        self._count = 100
        self._processes: list[VirtualProcess] = []
        self._holder_class = _holder_class(self)

    def start(self, person: str) -> VirtualProcess:
        """Start a process."""
        self._count += 1
        holder = self._holder_class(
            os_user=person,
            host="cell-pc",
            pid=self._count,
            process_start=f"pids {self._count}",
            boot=f"boot-{self.boots}",
            operator=person,
        )
        process = VirtualProcess(self._count, person, holder, self.journal)
        self._processes = [other for other in self._processes if other.alive]
        self._processes.append(process)
        return process

    def lives(self, pid: int) -> bool:
        """Return whether a process of that number is running."""
        return any(one.number == pid and one.alive for one in self._processes)

    def cut_power(self, now_ns: int, disk: FaultyDisk, seed: int) -> None:
        """Switch it off and on: all processes end, and the time since the start begins anew.

        Args:
            now_ns: The time.
            disk: Knows which data of the journal have reached it.
            seed: Draws which of the other sectors have.
        """
        with tempfile.TemporaryDirectory(dir=self.journal.parent) as kept:
            disk.after_power_cut(self.journal, Path(kept), seed=seed)
            for process in self._processes:
                process.end()
            self.lose()
            for path in Path(kept).iterdir():
                shutil.copyfile(path, self.journal.with_name(path.name))
        self.boots += 1
        self._surroundings.booted_ns = now_ns

    def harm(self, what: str, share: float) -> None:
        """Bend, truncate or lose the journal, that far into its file."""
        if what == "bent":
            self.bend(share)
        elif what == "truncated":
            self.truncate(share)
        else:
            self.lose()

    def bend(self, share: float) -> None:
        """Flip bits of one byte of the journal, that far into its file."""
        data = bytearray(self.journal.read_bytes())
        if len(data) > 200:
            data[100 + int(share * (len(data) - 101))] ^= 0x55
            self.journal.write_bytes(bytes(data))

    def truncate(self, share: float) -> None:
        """Truncate the journal's file."""
        data = self.journal.read_bytes()
        self.journal.write_bytes(data[: int(share * len(data))])
        self._beside("-wal").unlink(missing_ok=True)

    @property
    def known(self) -> bool:
        """Whether anything beside the journal shows that a controller was changed."""
        folder = state_folder("controllers")
        return folder.exists() and any(folder.iterdir())

    def lose(self) -> None:
        """Delete the journal, as somebody may who needs disk space."""
        for suffix in _SUFFIXES:
            self._beside(suffix).unlink(missing_ok=True)

    def set_aside(self) -> None:
        """Move an unusable journal away, as its error tells a person to."""
        for suffix in _SUFFIXES:
            path = self._beside(suffix)
            if path.exists():
                path.replace(path.with_name(f"damaged-{self._count}{path.name}"))

    def files_with(self, text: str) -> Iterator[str]:
        """Yield the names of the written files that contain a text."""
        for path in self._files():
            with suppress(OSError):
                if text.encode() in path.read_bytes():
                    yield path.name

    def _files(self) -> Iterator[Path]:
        for folder in (self.journal.parent, state_folder("controllers")):
            if folder.exists():
                yield from sorted(path for path in folder.rglob("*") if path.is_file())

    def _beside(self, suffix: str) -> Path:
        return self.journal.with_name(self.journal.name + suffix)


def _holder_class(computer: VirtualComputer) -> type[LeaseHolder]:
    class VirtualHolder(LeaseHolder):
        """A lease holder that knows the running processes of the virtual computer."""

        here: ClassVar[VirtualComputer] = computer

        def proves_gone(self, other: LeaseHolder) -> bool:
            """Whether that process, of the same start of the computer, has ended."""
            return self.shares_clock_with(other) and not self.here.lives(other.pid)

    return VirtualHolder
