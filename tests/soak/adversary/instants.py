"""The instants at which faults are most significant, and the share of draws from them."""

import random
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final


@dataclass(frozen=True, slots=True)
class Instant:
    """A fault and its place.

    Attributes:
        kind: The kind of disturbance, by its value.
        what: The fault itself.
        match: Text that the request, or the checkpoint, contains.
        count: The number of places to choose from.
        deeds: The deeds for which it is significant, by value; empty for all.
        first: The number of places to skip.
    """

    kind: str
    what: str
    match: str
    count: int = 1
    deeds: tuple[str, ...] = ()
    first: int = 0


SHARE: Final = 0.5
"""Share of all faults that are drawn from this list."""

_NOZZLE: Final = ("change the nozzle",)
_TYPED: Final = ("type a tool offset", "type two tool offsets")
_TWO: Final = ("type two tool offsets",)
_LEFT: Final = ("begin a movement and leave",)

INSTANTS: Final[Mapping[str, Sequence[Instant]]] = {
    "epson": (
        # A login that is altered on its way, and echoed in its refusal.
        Instant("wire", "GARBLE_REQUEST", "Login"),
        # A write that is acknowledged but not carried out.
        Instant("wire", "IGNORE_WRITE", "TLSet ", 2),
        *(Instant("wire", "IGNORE_WRITE", "TLSet ", 1, _TYPED),) * 2,
        Instant("wire", "IGNORE_WRITE", "TLSet 3, XY", 1, _TWO),
        # An answer that comes when nobody waits for it any more.
        Instant("wire", "DELAY", "Print", 40),
        # Just before a movement leaves, and at its answer.
        *(Instant("stop", "", "lock Move ", 15, _NOZZLE),) * 5,
        Instant("stop", "", "lock Go ", 3, _NOZZLE),
        # While the arm moves: a stop waits for no lock then, and its caller is told that it has
        # stopped.
        *(Instant("stop", "", 'wire sent $Execute,"Move ', 15, _NOZZLE),) * 3,
        *(Instant("stop", "", 'wire sent $Execute,"Move ', 1, _LEFT),) * 3,
        # Between a request and its answer.
        *(Instant("interrupt", "", 'wire sent $Execute,"TLSet ', 1, _TYPED),) * 2,
        Instant("interrupt", "", 'wire sent $Execute,"TLSet ', 1, _NOZZLE),
        Instant("interrupt", "", 'wire sent $Execute,"Move ', 15, _NOZZLE),
        # The journal can no longer be written, after a write and before it is recorded.
        *(Instant("disk", "UNWRITABLE", "commit before", 2, _TYPED, first=1),) * 2,
        # Killed while the arm moves; a person who sees it move stops it from another terminal.
        Instant("kill", "", 'wire sent $Execute,"Move ', 15, _NOZZLE),
        # The controller gives up waiting for a movement, and the arm goes on.
        Instant("machine", "GIVES_UP", "Move ", 15, _NOZZLE),
        # Somebody at the pendant, between the reading and the write, and at the turn test's
        # question.
        Instant("hand", "type", "question", 15, _NOZZLE),
        Instant("hand", "select", "question", 15, _NOZZLE),
        Instant("hand", "select", "question", 1, ("select a tool",)),
        # The clock is set between two changes.
        Instant("clock", "", "question", 3, ("type an offset twice, and take the last one back",)),
        # After the last write, before it is recorded.
        Instant("stop", "", "exchange Print TLSet", 3, _TYPED),
        *(Instant("stop", "", "commit ", 8, _TYPED),) * 2,
        Instant("stop", "", "commit after", 8, _NOZZLE, first=68),
        # Between the first and the second of two tools.
        *(Instant("stop", "", "procedure TLSet 3", 1, _TWO),) * 3,
        *(Instant("interrupt", "", "lock TLSet 3", 1, _TWO),) * 3,
    ),
    "softmotion": (
        # A lost block: nothing acknowledges it.
        Instant("wire", "DROP_REQUEST", "write_command", 12),
        # A restart of the PLC just before a command.
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
        # Just before a movement leaves; after the last write; between two tools.
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
"""The instants, by kind of cell."""


def drawn_instant(rng: random.Random, cell: str, deed: str) -> tuple[Instant, int] | None:
    """Return a significant instant of a deed, and its place among the matches; mostly ``None``."""
    if rng.random() >= SHARE:
        return None
    fitting = [one for one in INSTANTS.get(cell, ()) if not one.deeds or deed in one.deeds]
    if not fitting:
        return None
    instant = rng.choice(fitting)
    return instant, instant.first + rng.randrange(instant.count)


RARE_SHARE: Final = 0.15
"""Share of hours with an additional instant from the list below."""

RARE: Final[Mapping[str, Sequence[Instant]]] = {
    "epson": (
        # Somebody who needs disk space deletes the journal.
        Instant("disk", "lost", ""),
        # A write that is carried out, and whose answer is lost.
        Instant("wire", "DROP_REPLY", "TLSet 2, XY", 1, _TYPED),
        # A write that is acknowledged but not carried out.
        *(Instant("wire", "IGNORE_WRITE", "TLSet ", 1, _TYPED),) * 2,
        # The power fails when a write was sent: only what has reached the disk knows of it.
        Instant("power cut", "", 'wire sent $Execute,"TLSet ', 1, _TYPED),
    ),
    "softmotion": (
        Instant("disk", "lost", ""),
        Instant("power cut", "", "wire sent WRITE_TOOL", 1, _TYPED),
        Instant("wire", "DROP_REPLY", "WRITE_TOOL", 1, _TYPED),
        # A restart of the PLC after the first reading of a tool, before anything is written.
        Instant("machine", "RESTART", "read_slot"),
    ),
}
"""Instants that other shares miss too often; drawn by themselves, so no other draw changes."""


def drawn_rarity(rng: random.Random, cell: str, deed: str) -> Instant | None:
    """Return a rare significant instant of a deed; mostly ``None``."""
    fitting = [one for one in RARE.get(cell, ()) if not one.deeds or deed in one.deeds]
    return rng.choice(fitting) if fitting and rng.random() < RARE_SHARE else None
