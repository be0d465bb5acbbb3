"""The steps of an operator, and the wait before each.

A step is an act that the other operator can notice: a read or a write of a tool, a read or a
durable transaction of the journal; on a PLC each command in the mailbox, tool writes included, and
the reading of the PLC's answer.
"""

import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Final, Literal

from robolink.controllers.epson.session import EpsonSession
from robolink.controllers.softmotion.wire import MailboxWire
from robolink.journal import JournalOutcomeLog
from robolink.journal.store.store import Store, Tables
from robolink.protocols.epson_text import Refusal, Reply, Request
from robolink.protocols.mailbox import COMMAND, Opcode
from robolink.transport import MailboxHead

StepKind = Literal[
    "tool read",
    "tool write",
    "journal read",
    "journal write",
    "mailbox command",
    "mailbox answer",
]
Wait = Callable[..., None]
"""Waits before a step of a kind, with the tool if it is about one."""

ALL_TOOLS: Final = -1
"""The tools are listed at once."""

_TOOL: Final = re.compile(r"(Print )?TLSet\(?\s*(\d+)")


@dataclass(frozen=True)
class Waiting:
    """The next step.

    Attributes:
        kind: The kind of step.
        epoch: The epoch of the operator's lease; 0 without one.
        tool: The tool that is read or written, or :data:`ALL_TOOLS`; 0 for a step of another kind.
        by_mailbox: Whether a command in a PLC's mailbox writes the tool.
    """

    kind: StepKind
    epoch: int
    tool: int = 0
    by_mailbox: bool = False

    def touches(self) -> dict[str, bool]:
        """Return what the step touches that the other may see, and whether it changes it."""
        where, _, what = self.kind.partition(" ")
        tools = range(1, 16) if self.tool == ALL_TOOLS else [self.tool]
        touched = {f"{where} {tool}": what in ("write", "command") for tool in tools}
        if self.by_mailbox:
            touched["mailbox 0"] = True
        return touched


def wait_at_each_step(line: Connection, outcomes: JournalOutcomeLog) -> None:
    """Make this process report its next step, and wait for permission."""

    def wait(kind: StepKind, tool: int = 0, *, by_mailbox: bool = False) -> None:
        line.send(Waiting(kind, outcomes._lease._epoch, tool, by_mailbox))
        line.recv()

    _watch_window(wait)
    _watch_mailbox(wait)
    _watch_journal(wait)


def _watch_window(wait: Wait) -> None:
    ask = EpsonSession.ask

    def asked(session: EpsonSession, request: Request, *, secret: bool = False) -> Reply | Refusal:
        statement = request.parameters[0] if request.name == "Execute" else ""
        if statement == "TLSet":
            wait("tool read", ALL_TOOLS)
        elif found := _TOOL.match(statement):
            wait("tool read" if found[1] else "tool write", int(found[2]))
        return ask(session, request, secret=secret)

    EpsonSession.ask = asked  # type: ignore[method-assign, assignment]


def _watch_mailbox(wait: Wait) -> None:
    write, read_slot = MailboxWire.write, MailboxWire.read_slot
    read_head, read_response = MailboxWire.read_head, MailboxWire.read_response
    unseen: list[MailboxWire] = []

    def slot_read(wire: MailboxWire, slot: int) -> tuple[int, ...]:
        wait("tool read", slot)
        return read_slot(wire, slot)

    def block_written(wire: MailboxWire, words: Sequence[int], admit: Callable[[], None]) -> None:
        if words[COMMAND["opcode"].word] == Opcode.WRITE_TOOL:
            wait("tool write", words[COMMAND["i0"].word], by_mailbox=True)
        else:
            wait("mailbox command")
        write(wire, words, admit)
        unseen.append(wire)

    def before_answer() -> None:
        if unseen:
            unseen.clear()
            wait("mailbox answer")

    def head_read(wire: MailboxWire) -> MailboxHead:
        before_answer()
        return read_head(wire)

    def response_read(wire: MailboxWire) -> tuple[int, ...]:
        before_answer()  # where answers take longer than the PLC, no head is read first
        return read_response(wire)

    MailboxWire.write = block_written  # type: ignore[method-assign, assignment]
    MailboxWire.read_slot = slot_read  # type: ignore[method-assign, assignment]
    MailboxWire.read_head = head_read  # type: ignore[method-assign, assignment]
    MailboxWire.read_response = response_read  # type: ignore[method-assign, assignment]


def _watch_journal(wait: Wait) -> None:
    read, write = Store.read, Store.write

    @contextmanager
    def reading(store: Store, *told: str) -> Iterator[Tables]:
        wait("journal read")
        with read(store, *told) as tables:
            yield tables

    @contextmanager
    def writing(store: Store, what: str = "", then: str = "", **room: int) -> Iterator[Tables]:
        wait("journal write")
        with write(store, what, then, **room) as tables:
            yield tables

    Store.read, Store.write = reading, writing  # type: ignore[method-assign, assignment]
