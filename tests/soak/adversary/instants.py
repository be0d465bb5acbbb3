"""Instants at which what goes wrong tells most, and how often one of them is drawn."""

import random
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final


@dataclass(frozen=True, slots=True)
class Instant:
    """A fault, and where it comes.

    Attributes:
        kind: Which kind of hindrance, by its value.
        what: Which of its kind.
        match: Text that the request, or the checkpoint, contains.
        count: How many of those there are to choose from.
        deeds: The deeds in which it tells, by value; empty for each.
        first: How many are passed over.
    """

    kind: str
    what: str
    match: str
    count: int = 1
    deeds: tuple[str, ...] = ()
    first: int = 0


SHARE: Final = 0.5
"""Share of all faults that are drawn from here."""

_NOZZLE: Final = ("change the nozzle",)
_TYPED: Final = ("type a tool offset", "type two tool offsets")
_TWO: Final = ("type two tool offsets",)
_LEFT: Final = ("begin a movement and leave",)

INSTANTS: Final[Mapping[str, Sequence[Instant]]] = {
    "epson": (
        # A login that is bent on its way, and comes back in its refusal.
        Instant("wire", "GARBLE_REQUEST", "Login"),
        # A write that is acknowledged, and not carried out.
        Instant("wire", "IGNORE_WRITE", "TLSet ", 2),
        *(Instant("wire", "IGNORE_WRITE", "TLSet ", 1, _TYPED),) * 2,
        Instant("wire", "IGNORE_WRITE", "TLSet 3, XY", 1, _TWO),
        # An answer that comes when nobody waits for it any more.
        Instant("wire", "DELAY", "Print", 40),
        # Just before a movement leaves, and at its answer.
        *(Instant("stop", "", "lock Move ", 15, _NOZZLE),) * 5,
        Instant("stop", "", "lock Go ", 3, _NOZZLE),
        # While the arm moves: whoever stops waits for no lock then, and is told that it rests.
        *(Instant("stop", "", 'wire sent $Execute,"Move ', 15, _NOZZLE),) * 3,
        *(Instant("stop", "", 'wire sent $Execute,"Move ', 1, _LEFT),) * 3,
        # Between a request and its answer.
        *(Instant("interrupt", "", 'wire sent $Execute,"TLSet ', 1, _TYPED),) * 2,
        Instant("interrupt", "", 'wire sent $Execute,"TLSet ', 1, _NOZZLE),
        Instant("interrupt", "", 'wire sent $Execute,"Move ', 15, _NOZZLE),
        # The journal cannot be written any more, behind a write and before it is on record.
        *(Instant("disk", "UNWRITABLE", "commit before", 2, _TYPED, first=1),) * 2,
        # Killed while the arm moves; whoever sees it go on stops it from another terminal.
        Instant("kill", "", 'wire sent $Execute,"Move ', 15, _NOZZLE),
        # The controller gives up waiting for a movement, and the arm goes on.
        Instant("machine", "GIVES_UP", "Move ", 15, _NOZZLE),
        # Somebody at the pendant, between the look and the write, and while the proof is asked for.
        Instant("hand", "type", "question", 15, _NOZZLE),
        Instant("hand", "select", "question", 15, _NOZZLE),
        Instant("hand", "select", "question", 1, ("select a tool",)),
        # The clock is set between two changes.
        Instant("clock", "", "question", 3, ("type an offset twice, and take the last one back",)),
        # Behind the last write, before it is on record.
        Instant("stop", "", "exchange Print TLSet", 3, _TYPED),
        *(Instant("stop", "", "commit ", 8, _TYPED),) * 2,
        Instant("stop", "", "commit after", 8, _NOZZLE, first=68),
        # Between the first and the second of two tools.
        *(Instant("stop", "", "procedure TLSet 3", 1, _TWO),) * 3,
        *(Instant("interrupt", "", "lock TLSet 3", 1, _TWO),) * 3,
    ),
    "softmotion": (
        # A block that is lost: nothing acknowledges it.
        Instant("wire", "DROP_REQUEST", "write_command", 12),
        # A start of the PLC just before it is told something.
        Instant("machine", "RESTART", "write_command", 30),
        Instant("machine", "RESTART", "WRITE_TOOL", 2),
        # Another client's block in the same cycle, under the same number.
        Instant("another client", "", "MOVE_LINEAR", 18, _NOZZLE),
        Instant("another client", "", "SELECT_TOOL", 2, _NOZZLE),
        Instant("another client", "", "WRITE_TOOL", 2),
        Instant("hand", "type", "question", 15, _NOZZLE),
        Instant("hand", "select", "question", 15, _NOZZLE),
        Instant("hand", "select", "question", 1, ("select a tool",)),
        Instant("clock", "", "question", 3, ("type an offset twice, and take the last one back",)),
        # Just before a movement leaves; behind the last write; between two tools.
        *(Instant("stop", "", "lock 2103", 15, _NOZZLE),) * 5,
        *(Instant("stop", "", "wire sent MOVE_LINEAR", 15, _NOZZLE),) * 2,
        *(Instant("interrupt", "", "wire sent WRITE_TOOL", 1, _TYPED),) * 2,
        Instant("interrupt", "", "wire sent WRITE_TOOL", 1, _NOZZLE),
        Instant("interrupt", "", "wire sent MOVE_LINEAR", 15, _NOZZLE),
        *(Instant("disk", "UNWRITABLE", "commit before", 2, _TYPED, first=1),) * 2,
        Instant("kill", "", "wire sent MOVE_LINEAR", 15, _NOZZLE),
        Instant("stop", "", "exchange 5205", 2, _TYPED),
        *(Instant("stop", "", "commit ", 6, _TYPED),) * 2,
        Instant("stop", "", "commit after", 8, _NOZZLE, first=68),
        *(Instant("stop", "", "procedure 5205 WRITE_TOOL 3", 1, _TWO),) * 3,
        *(Instant("interrupt", "", "lock 5205 WRITE_TOOL 3", 1, _TWO),) * 3,
    ),
}
"""By kind of cell."""


def drawn_instant(rng: random.Random, cell: str, deed: str) -> tuple[Instant, int] | None:
    """Return an instant that tells in a deed, and which of those that match; mostly ``None``."""
    if rng.random() >= SHARE:
        return None
    fitting = [one for one in INSTANTS.get(cell, ()) if not one.deeds or deed in one.deeds]
    if not fitting:
        return None
    instant = rng.choice(fitting)
    return instant, instant.first + rng.randrange(instant.count)


RARE_SHARE: Final = 0.15
"""Share of hours in which one of these comes besides."""

RARE: Final[Mapping[str, Sequence[Instant]]] = {
    "epson": (
        # Somebody who looks for space deletes the journal.
        Instant("disk", "lost", ""),
        # A write that takes, and whose answer is lost.
        Instant("wire", "DROP_REPLY", "TLSet 2, XY", 1, _TYPED),
        # A write that is acknowledged, and not carried out.
        *(Instant("wire", "IGNORE_WRITE", "TLSet ", 1, _TYPED),) * 2,
    ),
    "softmotion": (
        Instant("disk", "lost", ""),
        Instant("wire", "DROP_REPLY", "WRITE_TOOL", 1, _TYPED),
        # A start of the PLC behind the first look at a tool, before anything is written.
        Instant("machine", "RESTART", "read_slot"),
    ),
}
"""What the shares of the others leave out too often; drawn by itself, so that it moves no other."""


def drawn_rarity(rng: random.Random, cell: str, deed: str) -> Instant | None:
    """Return something rare that tells in a deed; mostly ``None``."""
    fitting = [one for one in RARE.get(cell, ()) if not one.deeds or deed in one.deeds]
    return rng.choice(fitting) if fitting and rng.random() < RARE_SHARE else None
