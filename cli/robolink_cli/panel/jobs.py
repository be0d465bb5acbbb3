"""Jobs: each is the ordinary command in a process of its own, shown and answered over a socket.

This process holds no controller. Where it ends, the socket of each job ends with it, and the job
ends in order as for a closed terminal.
"""

import asyncio
import json
import os
import socket
import sys
import time
from collections import deque
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import Any, Final

from robolink.messages import spoken
from robolink.model import PersonRole
from robolink_cli.console.language import VARIABLE
from robolink_cli.panel.words import speaking_in
from robolink_cli.wizard.views.page_ways import TITLES
from robolink_cli.wizard.views.records import View
from robolink_cli.wizard.views.wire import from_wire

MOST_BYTES: Final = 64 * 1024
"""Longest line on the socket, in bytes."""

_MOST_UNSENT: Final = 16 * 1024
"""Bytes that a job has not taken yet, from which beats and signs of life are left out."""

_HELD_S: Final = 1.0
"""For so long in s after its last sign a finger counts as down: longer than its lease, and a
step."""

_IN_ORDER: Final = range(70)
"""Exit codes of a command that ended in order; 70 is for a bug."""

_MOST_TOLD: Final = 20
_MOST_ERRORS: Final = 4096


@dataclass(frozen=True, slots=True)
class JobKind:
    """A job that can be begun from a page.

    Attributes:
        name: What a press of ``/start`` names.
        title: What it is called, in English.
        words: The command.
        role: Who may begin it.
        values: The options that may go with it, and for each the option of the command.
        of_station: Whether it is about one station of the cell, which the press names.
        of_recipe: Whether it follows a recipe, which the press may name.
        of_plan: Whether it is the job of a plan, which the press names.
    """

    name: str
    title: str
    words: tuple[str, ...]
    role: PersonRole = PersonRole.OPERATOR
    values: Mapping[str, str] = field(default_factory=dict)
    of_station: bool = False
    of_recipe: bool = False
    of_plan: bool = False


KINDS: Final = {
    kind.name: kind
    for kind in (
        JobKind("plan", TITLES["plan"], ("fleet", "next"), of_plan=True),
        JobKind("change", TITLES["change"], ("change",), of_recipe=True),
        JobKind("recover", TITLES["recover"], ("recover",)),
        JobKind("release", TITLES["release"], ("robot", "release")),
        JobKind("check", TITLES["check"], ("cell", "check")),
        JobKind("undo", TITLES["undo"], ("undo",), PersonRole.ENGINEER),
        JobKind(
            "station",
            TITLES["station"],
            ("cell", "station", "learn"),
            PersonRole.ENGINEER,
            of_station=True,
        ),
    )
}
"""The jobs, by name."""


@dataclass(frozen=True, slots=True)
class JobEnd:
    """How a job's process ended.

    Attributes:
        code: Its exit code; ``None`` where it did not say one.
        kept: What is to be read when its screen is gone.
        errors: The last it wrote beside; empty where it ended in order.
    """

    code: int | None
    kept: tuple[str, ...] = ()
    errors: str = ""

    @property
    def in_order(self) -> bool:
        """Whether it said itself that it ends."""
        return self.code is not None


class PanelJob:
    """One job of one cell.

    Args:
        cell: Name of the cell.
        kind: What is done.
        language: In which language.
        who: The person, for the record; empty for nobody.
        changed: Called when there is something new to show.
        values: What goes with the command: options, and their values.
        station: Whose place is found, and with which tool; ``None`` where it is about no station.
        subject: File of the recipe, or id of the plan; empty where the job lets the person choose.

    Attributes:
        view: What it shows; ``None`` before it has shown anything.
        view_s: When that came, monotonic.
        told: What it told last.
        end: How it ended; ``None`` while it runs.
    """

    program = "robolink_cli.job_process"
    """The module that is run."""

    def __init__(
        self,
        cell: str,
        kind: JobKind,
        *,
        language: str,
        who: str,
        changed: Callable[[], None],
        values: Mapping[str, str] | None = None,
        station: tuple[str, int] | None = None,
        subject: str = "",
    ) -> None:
        self.cell, self.kind, self.language, self.who = cell, kind, language, who
        self._changed = changed
        self._values = dict(values or {})
        self._station, self._subject = station, subject
        self.view: View | None = None
        self.view_s = time.monotonic()
        self.told: deque[str] = deque(maxlen=_MOST_TOLD)
        self.end: JobEnd | None = None
        self._left: JobEnd | None = None
        self._leaves = False
        self._errors = b""
        self._process: asyncio.subprocess.Process | None = None
        self._writer: asyncio.StreamWriter | None = None
        self._finger, self._finger_s = "", 0.0
        self._task: asyncio.Task[None] | None = None

    @property
    def pid(self) -> int | None:
        """Number of its process."""
        return self._process.pid if self._process else None

    @property
    def arguments(self) -> list[str]:
        """The command line that it runs, without the program."""
        who = ["--operator", self.who] if self.who else []
        given = [word for name, value in self._values.items() for word in (name, value)]
        if self._station is not None:
            name, tool = self._station
            given += ["--tool", str(tool), "--", name]
        elif self._subject:
            given += ["--", self._subject]
        return ["-c", self.cell, *who, *self.kind.words, *given]

    async def start(self) -> None:
        """Start its process.

        Raises:
            OSError: It cannot be started.
        """
        ours, its = socket.socketpair()
        try:
            its.set_inheritable(True)
            self._process = await asyncio.create_subprocess_exec(
                sys.executable,
                *("-m", self.program, str(its.fileno()), *self.arguments),
                stdin=asyncio.subprocess.DEVNULL,
                stdout=asyncio.subprocess.DEVNULL,
                stderr=asyncio.subprocess.PIPE,
                pass_fds=(its.fileno(),),
                env={**os.environ, VARIABLE: self.language, "PYTHONIOENCODING": "utf-8"},
                start_new_session=True,  # Ctrl-C is for the panel, which then ends it in order
            )
        except BaseException:
            ours.close()
            raise
        finally:
            its.close()
        reader, self._writer = await asyncio.open_connection(sock=ours, limit=MOST_BYTES)
        self._task = asyncio.ensure_future(self._follow(reader))

    def press(self, number: int, action: str, value: str) -> None:
        """Pass a press on."""
        self._send({"t": "press", "number": number, "action": action, "value": value})

    def hold(self, number: int, axis: str, finger: str) -> None:
        """Pass on that a finger came down on a key that repeats."""
        self._finger, self._finger_s = finger, time.monotonic()
        self._send({"t": "hold", "number": number, "axis": axis, "finger": finger})

    def beat(self, finger: str) -> None:
        """Pass on that a finger is still down."""
        if finger == self._finger:
            self._finger_s = time.monotonic()
        self._send({"t": "beat", "finger": finger}, may_be_lost=True)

    def release(self, finger: str) -> None:
        """Pass on that a finger is up."""
        if finger == self._finger:
            self._finger = ""
        self._send({"t": "release", "finger": finger})

    @property
    def is_held(self) -> bool:
        """Whether a finger is on a key that repeats, or was until just now."""
        return bool(self._finger) and time.monotonic() - self._finger_s < _HELD_S

    def alive(self) -> None:
        """Pass on that the seat's tablet is heard."""
        self._send({"t": "alive"}, may_be_lost=True)

    def leave(self) -> None:
        """End it in order, as a closed terminal does."""
        self._leaves = True
        self._send({"t": "leave"})

    async def close(self, wait_s: float) -> bool:
        """End it in order, and wait for that; return whether it has ended."""
        self.leave()
        if self._task is not None:
            with suppress(TimeoutError):
                await asyncio.wait_for(asyncio.shield(self._task), wait_s)
        return self.end is not None

    async def wait(self) -> None:
        """Wait for its end."""
        if self._task is not None:
            await asyncio.shield(self._task)

    def _send(self, said: Mapping[str, object], *, may_be_lost: bool = False) -> None:
        writer = self._writer
        if writer is None or writer.is_closing():
            return
        transport = writer.transport
        if may_be_lost and transport.get_write_buffer_size() > _MOST_UNSENT:
            return
        line = json.dumps(said).encode() + b"\n"
        if len(line) <= MOST_BYTES:
            writer.write(line)

    async def _follow(self, reader: asyncio.StreamReader) -> None:
        process = self._process
        assert process is not None and process.stderr is not None  # noqa: S101, PT018 - started
        errors = asyncio.ensure_future(self._keep_errors(process.stderr))
        try:
            # A line that is too long, or is none of the contract, ends the job in order: what it
            # shows could not be trusted any more.
            with suppress(ValueError, OSError, KeyError, TypeError, AttributeError):
                while line := await reader.readuntil(b"\n"):
                    self._heard(json.loads(line))
        except (asyncio.IncompleteReadError, asyncio.LimitOverrunError):
            pass
        finally:
            if self._writer is not None:
                self._writer.close()
        await process.wait()
        await errors
        text = self._errors.decode(errors="replace").strip()
        # Who was told that nobody is there says nothing more; its exit code tells how it ended.
        code = process.returncode if self._leaves and process.returncode in _IN_ORDER else None
        self.end = self._left or JobEnd(code, tuple(self.told), text)
        self._changed()

    async def _keep_errors(self, stream: asyncio.StreamReader) -> None:
        while data := await stream.read(_MOST_ERRORS):
            self._errors = (self._errors + data)[-_MOST_ERRORS:]

    def _heard(self, said: Mapping[str, Any]) -> None:
        match said["t"]:
            case "view":
                self.view, self.view_s = self._named(from_wire(said["view"])), time.monotonic()
            case "told":
                self.told.append(str(said["text"]))
            case "left":
                self._left = JobEnd(int(said["code"]), tuple(map(str, said["kept"])))
            case _:
                return
        self._changed()

    def _named(self, view: View) -> View:
        """Return a view with cell and job in its head, where the command did not name them yet."""
        head = view.head
        if head.cell and head.job:
            return view
        with speaking_in(self.language):
            title = spoken(self.kind.title)
        return replace(view, head=replace(head, cell=head.cell or self.cell, job=head.job or title))


def options_of(kind: JobKind, given: object) -> dict[str, str]:
    """Return the options of a command from what a page gave; what it does not know is left out.

    Args:
        kind: The job.
        given: ``values`` of the press.
    """
    if not isinstance(given, Mapping):
        return {}
    known = kind.values
    return {
        known[name]: value
        for name, value in given.items()
        if name in known and isinstance(value, str) and value and not value.startswith("-")
    }


async def end_all(jobs: Iterable[PanelJob], wait_s: float) -> list[PanelJob]:
    """End jobs in order; return those that take longer, and end by themselves."""
    running = [job for job in jobs if job.end is None]
    ended = await asyncio.gather(*(job.close(wait_s) for job in running))
    return [job for job, done in zip(running, ended, strict=True) if not done]
